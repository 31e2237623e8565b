// The page of a session. What comes next, and whether a vote counts, is the server's business; here
// clips are checked, painted and timed, and a vote is taken.

const GRADES_MAX = 11; // as boxes; a longer scale is a number to type

const $ = (id) => document.getElementById(id);
const screens = ["stage", "start", "pause", "vote", "done", "problem"];
const canvas = $("screen");
const context = canvas.getContext("2d", { alpha: false, colorSpace: "srgb" });
let test; // what /api/session says of the whole test

function show(name) {
  for (const screen of screens) $(screen).hidden = screen !== name;
}

function say(text) {
  $("label").textContent = text;
}

async function api(path, body) {
  const options = body === undefined ? {} : {
    method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body),
  };
  const answer = await fetch(path, options);
  const values = await answer.json();
  if (!answer.ok) throw new Error(values.error);
  return values;
}

// ---- time: everything on the screen follows the display's own clock

const vsync = () => new Promise((resolve) => requestAnimationFrame(resolve));

async function measureRefresh() {
  const intervals = [];
  let before = await vsync();
  for (let i = 0; i < 120; i++) {
    const now = await vsync();
    intervals.push(now - before);
    before = now;
  }
  intervals.sort((a, b) => a - b);
  return 1000 / intervals[intervals.length / 2];
}

async function until(time) {
  let now = performance.now();
  while (now < time) now = await vsync();
}

// ---- clips

function paintGrey() {
  context.fillStyle = test.grey;
  context.fillRect(0, 0, canvas.width, canvas.height);
}

async function sha256(bytes) {
  const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", bytes));
  return Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

function imageOf(rgb) {
  const image = new ImageData(test.width, test.height);
  const rgba = image.data;
  for (let i = 0, j = 0; i < rgb.length; i += 3, j += 4) {
    rgba[j] = rgb[i];
    rgba[j + 1] = rgb[i + 1];
    rgba[j + 2] = rgb[i + 2];
    rgba[j + 3] = 255;
  }
  return image;
}

async function load(presentation, which) {
  const hashes = presentation.sha256[which];
  const shown = presentation.steps.find((step) => step.show === which).frames;
  const images = [];
  for (let i = 0; i < Math.min(shown, hashes.length); i++) {
    const answer = await fetch(`/api/presentations/${presentation.id}/${which}/${i}`);
    if (!answer.ok) throw new Error((await answer.json()).error);
    const bytes = await answer.arrayBuffer();
    if ((await sha256(bytes)) !== hashes[i]) throw new Error(`Frame ${i} of the ${which} arrived damaged.`);
    images.push(imageOf(new Uint8Array(bytes)));
  }
  return images;
}

// Paint a clip and return what was painted when; `frames` may exceed the images: they start again.
function play(images, frames, which) {
  return new Promise((resolve) => {
    const log = { show: which, frames: [], longest_interval_ms: 0, hidden: document.hidden };
    let first, last = -1, painted;
    const stayed = (now) => { log.longest_interval_ms = Math.max(log.longest_interval_ms, now - painted); };
    const tick = (now) => {
      first ??= now;
      log.hidden ||= document.hidden;
      // A quarter of a frame early is on time: the display's clock and the clip's never agree.
      const frame = Math.floor((now - first) * test.fps / 1000 + 0.25);
      if (frame >= frames) {
        paintGrey();
        stayed(now);
        resolve(log);
        return;
      }
      if (frame !== last) {
        context.putImageData(images[frame % images.length], 0, 0);
        if (last >= 0) stayed(now);
        log.frames.push([frame, Math.round((now - first) * 1000) / 1000]);
        last = frame;
        painted = now;
      }
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  });
}

// ---- the display: one pixel of the clip is one pixel of the screen

function lay() {
  const ratio = window.devicePixelRatio;
  const [width, height] = [Math.round(window.innerWidth * ratio), Math.round(window.innerHeight * ratio)];
  canvas.style.width = `${test.width / ratio}px`;
  canvas.style.height = `${test.height / ratio}px`;
  canvas.style.left = `${Math.floor((width - test.width) / 2) / ratio}px`;
  canvas.style.top = `${Math.floor((height - test.height) / 2) / ratio}px`;
  if (width < test.width || height < test.height) {
    throw new Error(`The clips have ${test.width} x ${test.height} pixels, this window ${width} x ${height}.`
      + " Use the full screen (F11), or a larger display.");
  }
}

function display(refresh) {
  return {
    refresh_hz: refresh,
    device_pixel_ratio: window.devicePixelRatio,
    window_px: [window.innerWidth, window.innerHeight],
    screen_px: [window.screen.width, window.screen.height],
    full_screen: document.fullscreenElement !== null,
    visible: !document.hidden,
    browser: navigator.userAgent,
  };
}

function fullScreen() {
  // Refused by some browsers: then the window's size decides, in lay().
  return document.documentElement.requestFullscreen?.({ navigationUI: "hide" }).catch(() => {});
}

// ---- votes

const longScale = () => test.scale[1] - test.scale[0] >= GRADES_MAX;

function grades() {
  const [worst, best] = test.scale;
  return Array.from({ length: best - worst + 1 }, (_, i) => worst + i);
}

function element(tag, properties, ...children) {
  const node = Object.assign(document.createElement(tag), properties);
  node.append(...children);
  return node;
}

// The words of the ends stand below the scale, and in the name of the first and the last grade.
function ends() {
  const texts = test.labels.map((label) => element("span", { ariaHidden: !longScale() }, label));
  return element("div", { className: "ends" }, ...texts);
}

function nameOf(grade) {
  const end = grade === test.scale[0] ? test.labels[0] : grade === test.scale[1] ? test.labels[1] : "";
  return end ? `${grade}, ${end}` : String(grade);
}

function buildScale() {
  const [worst, best] = test.scale;
  if (longScale()) {
    const range = test.scale.map((grade, i) => `${grade} (${test.labels[i]})`).join(" to ");
    $("example").append(range);
    const input = element("input", { id: "number", name: "grade", type: "number", min: worst, max: best, step: 1, autocomplete: "off" });
    $("grades").append(element("label", {}, `${range}: `, input));
    return;
  }
  for (const grade of grades()) {
    $("example").append(element("div", { className: "grade" }, element("span", {}, String(grade))));
    const input = element("input", { type: "radio", name: "grade", value: grade, ariaLabel: nameOf(grade) });
    $("grades").append(element("label", { className: "grade" }, input, element("span", {}, String(grade))));
  }
  $("example").after(ends());
  $("grades").after(ends());
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
function ask(ended) {
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

// The server answers once the vote is on the disk; until then, the same vote is sent again.
async function send(path, vote) {
  for (;;) {
    try {
      return await api(path, vote);
    } catch (error) {
      if (!(error instanceof TypeError)) throw error;
      $("saving").textContent = "Your vote is not stored yet: no answer. Trying again …";
      await until(performance.now() + 1000);
    }
  }
}

// ---- the session

function pressedButton(button) {
  return new Promise((resolve) => {
    button.onclick = resolve;
    button.focus();
  });
}

async function present(presentation, refresh, notBefore) {
  say("Please wait");
  show("stage");
  lay();
  paintGrey();
  const clips = { reference: await load(presentation, "reference"), test: await load(presentation, "test") };
  await until(notBefore);
  lay();
  const path = `/api/presentations/${presentation.id}`;
  const { showing } = await api(`${path}/start`, display(refresh));
  const logs = [];
  for (const step of presentation.steps) {
    say(step.label);
    if (step.show === "grey") {
      await until((await vsync()) + 1000 * step.seconds);
    } else {
      logs.push(await play(clips[step.show], step.frames, step.show));
    }
  }
  const ended = performance.now();
  const [vote, reaction_ms] = await ask(ended);
  await send(`${path}/vote`, { showing, vote, reaction_ms, clips: logs });
  return ended + 1000 * test.vote_s;
}

async function run(refresh) {
  let notBefore = 0;
  let before = "";
  for (;;) {
    const presentation = await api("/api/next");
    if (presentation.done) break;
    if (before === "training" && presentation.kind !== "training") {
      show("pause");
      await pressedButton($("go-on"));
    }
    notBefore = await present(presentation, refresh, notBefore);
    before = presentation.kind;
  }
  show("done");
  if (document.fullscreenElement) await document.exitFullscreen();
}

function describe() {
  const [worst, best] = test.scale;
  if (test.title) document.title = test.title;
  $("times").textContent = test.times_shown > 1 ? "Each pair is shown twice; vote after the second time." : "";
  $("training").hidden = !test.training;
  $("again").hidden = !test.begun;
  buildScale();
  const ten = best >= 10 && worst > 0 ? ", 0 for 10" : "";
  const others = grades().every((grade) => grade >= 0 && grade <= (worst > 0 ? 10 : 9)) ? "" : ", or Tab and the arrows";
  const keys = longScale()
    ? "Type the number; Enter confirms."
    : `Keys: the digits${ten}${others}; or the mouse. Enter confirms.`;
  $("keys").textContent = keys;
  $("keys-start").textContent = keys;
  canvas.width = test.width;
  canvas.height = test.height;
}

function warnOf(refresh) {
  const ratio = refresh / test.fps;
  const uneven = Math.abs(ratio - Math.round(ratio)) > 0.02 * ratio || ratio < 0.98;
  $("display").textContent = uneven
    ? `For the experimenter: this display shows ${refresh.toFixed(1)} pictures a second, no multiple of the`
      + ` clips' ${test.fps}. Motion will be uneven.`
    : "";
}

async function main() {
  try {
    test ??= await api("/api/session");
    if (!$("example").childElementCount) describe();
    show("start");
    const measured = measureRefresh();
    const ready = pressedButton($("begin"));
    measured.then(warnOf);
    await ready;
    await fullScreen();
    await run(await measured);
  } catch (error) {
    if (document.fullscreenElement) await document.exitFullscreen();
    $("what").textContent = error instanceof TypeError ? "The session's server does not answer." : error.message;
    show("problem");
    await pressedButton($("retry"));
    window.location.reload();
  }
}

main();
