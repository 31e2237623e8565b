// The ballot: one grade of the scale, by keyboard or mouse, confirmed.

import { $, element, show } from "./dom.js";

const GRADES_MAX = 11; // as boxes; a longer scale is a number to type

let test; // what /api/session says of the whole test

const longScale = () => test.scale[1] - test.scale[0] >= GRADES_MAX;

function grades() {
  const [worst, best] = test.scale;
  return Array.from({ length: best - worst + 1 }, (_, i) => worst + i);
}

// The words of the ends stand below the scale, and in the name of the first and the last grade.
function ends() {
  const texts = test.labels.map((label) => element("span", { ariaHidden: !longScale() }, label));
  return element("div", { className: "ends" }, ...texts);
}

function nameOf(grade) {
  const word = test.words[grade - test.scale[0]];
  const end = grade === test.scale[0] ? test.labels[0] : grade === test.scale[1] ? test.labels[1] : "";
  return word || end ? `${grade}, ${word || end}` : String(grade);
}

function box(grade) {
  const word = test.words[grade - test.scale[0]];
  const text = word ? [element("b", {}, String(grade)), ` ${word}`] : [String(grade)];
  return element("span", {}, ...text);
}

function describeKeys() {
  const [worst, best] = test.scale;
  const ten = best >= 10 && worst > 0 ? ", 0 for 10" : "";
  const others = grades().every((grade) => grade >= 0 && grade <= (worst > 0 ? 10 : 9)) ? "" : ", or Tab and the arrows";
  return longScale()
    ? "Type the number; Enter confirms."
    : `Keys: the digits${ten}${others}; or the mouse. Backspace takes it back. Enter confirms.`;
}

export function buildScale(described) {
  test = described;
  const [worst, best] = test.scale;
  $("keys").textContent = describeKeys();
  $("keys-start").textContent = describeKeys();
  const form = test.words.length ? "list" : "scale";
  $("example").className = form;
  $("grades").className = form;
  if (longScale()) {
    const range = test.scale.map((grade, i) => `${grade} (${test.labels[i]})`).join(" to ");
    $("example").append(range);
    const input = element("input", { id: "number", name: "grade", type: "number", min: worst, max: best, step: 1, autocomplete: "off" });
    $("grades").append(element("label", {}, `${range}: `, input));
    return;
  }
  // A list has the best grade on top, as scales of impairment are printed.
  const order = test.words.length ? grades().reverse() : grades();
  for (const grade of order) {
    $("example").append(element("div", { className: "grade" }, box(grade)));
    const input = element("input", { type: "radio", name: "grade", value: grade, ariaLabel: nameOf(grade) });
    $("grades").append(element("label", { className: "grade" }, input, box(grade)));
  }
  if (!test.words.length) {
    $("example").after(ends());
    $("grades").after(ends());
  }
}

function chosen() {
  const value = new FormData($("ballot")).get("grade");
  const grade = value === null || value === "" ? NaN : Number(value);
  return grades().includes(grade) ? grade : null;
}

function gradeOfKey(key) {
  if (!/^[0-9]$/.test(key)) return null;
  const digit = Number(key);
  if (grades().includes(digit)) return digit;
  return digit === 0 && grades().includes(10) ? 10 : null;
}

function pressed(event) {
  if (longScale() || event.ctrlKey || event.altKey || event.metaKey) return;
  const grade = gradeOfKey(event.key);
  const clear = event.key === "Backspace";
  if (grade === null && !clear) return;
  event.preventDefault();
  for (const input of $("grades").querySelectorAll("input")) {
    input.checked = Number(input.value) === grade && !clear;
    if (input.checked) input.focus();
  }
  $("confirm").disabled = chosen() === null;
}

// Show the ballot and return [vote, reaction time in ms] once the observer has confirmed.
export function ask(ended) {
  return new Promise((resolve) => {
    const form = $("ballot");
    form.reset();
    $("confirm").disabled = true;
    $("saving").textContent = "";
    show("vote");
    // Focus on a grade would look like a suggestion; a number to type needs it.
    (longScale() ? $("number") : $("question")).focus();
    document.addEventListener("keydown", pressed);
    form.oninput = () => { $("confirm").disabled = chosen() === null; };
    form.onsubmit = (event) => {
      event.preventDefault();
      const vote = chosen();
      if (vote === null) return;
      form.onsubmit = (again) => again.preventDefault();
      document.removeEventListener("keydown", pressed);
      resolve([vote, performance.now() - ended]);
    };
  });
}
