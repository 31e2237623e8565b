// What is asked before the first clip: observer, consent, display.

import { api } from "./api.js";
import { drawPattern, listMeasured, measured } from "./display.js";
import { $, element, pressedButton, show } from "./dom.js";

const NUMBERS = new Set([
  "acuity", "colour_plates", "colour_read", "diagonal_inch", "peak_cd_m2", "black_cd_m2",
  "distance_heights", "room_lux",
]);

// The fields of a form as values; a number that was left out is not there.
function valuesOf(form) {
  const values = {};
  for (const [name, text] of new FormData(form)) {
    if (NUMBERS.has(name)) {
      if (text !== "") values[name] = Number(text);
    } else {
      values[name] = text === "true" || text === "false" ? text === "true" : text;
    }
  }
  return values;
}

// Show a form until the server takes it; `body` makes the request of its values.
function filled(name, body) {
  const form = $(`${name}-form`);
  show(name);
  form.querySelector("select, input").focus();
  return new Promise((resolve) => {
    form.onsubmit = async (event) => {
      event.preventDefault();
      try {
        resolve((await api(`/api/forms/${name}`, body(valuesOf(form)))).missing);
      } catch (error) {
        form.querySelector(".fault").textContent = error.message;
      }
    };
  });
}

async function consent(test) {
  $("consent-text").replaceChildren(...test.consent.split(/\n\s*\n/).map((text) => element("p", {}, text)));
  show("consent");
  await new Promise((resolve, reject) => {
    pressedButton($("agree")).then(resolve);
    $("disagree").onclick = () => reject(new Error("The observer does not agree. No vote was taken."));
  });
  return (await api("/api/forms/consent", { sha256: test.consent_sha256 })).missing;
}

async function display(test, refresh) {
  const form = $("display-form");
  for (const [name, value] of Object.entries({ ...test.viewing, ...test.display })) {
    const field = form.elements.namedItem(name);
    if (field && value !== null) field.value = value;
  }
  drawPattern($("pattern"));
  const facts = measured(refresh);
  listMeasured(test, facts);
  return filled("display", ({ steps_seen, pixels_even, note, ...values }) => ({
    display: values, steps_seen, pixels_even, note, measured: facts,
  }));
}

export async function fillForms(test, refresh) {
  $("name").textContent = test.observer;
  let missing = test.missing;
  while (missing.length) {
    const [form] = missing;
    if (form === "observer") missing = await filled("observer", (values) => values);
    else if (form === "consent") missing = await consent(test);
    else missing = await display(test, await refresh);
  }
}
