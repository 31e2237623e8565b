// The page of a session. What comes next, and whether a vote counts, is the server's business; here
// clips are checked, painted and timed, and a vote is taken.

import { api, holdWindow, releaseWindow, send } from "./api.js";
import { ask, buildScale } from "./ballot.js";
import { load, paintGrey, play } from "./clips.js";
import { fullScreen, lay, measured, measureRefresh, until, vsync, warnings } from "./display.js";
import { $, pressedButton, say, show } from "./dom.js";
import { fillForms } from "./forms.js";

const canvas = $("screen");

// Show the steps on this page and return a log for each clip.
async function paint(presentation, clips, test) {
  const logs = [];
  for (const step of presentation.steps) {
    say(step.label);
    if (step.show === "grey") {
      await until((await vsync()) + 1000 * step.seconds);
    } else {
      logs.push(await play(clips[step.show], step.frames, step.show, test));
    }
  }
  return logs;
}

async function present(presentation, test, refresh, notBefore) {
  say("Please wait");
  show("stage");
  const here = test.player === "page";
  const clips = {};
  if (here) {
    lay(canvas, test);
    paintGrey(test);
    for (const which of ["reference", "test"]) clips[which] = await load(presentation, which, test);
  }
  await until(notBefore);
  if (here) lay(canvas, test);
  const path = `/api/presentations/${presentation.id}`;
  const { showing } = await api(`${path}/start`, measured(refresh));
  let logs = [];
  if (here) {
    logs = await paint(presentation, clips, test);
  } else {
    say("Please look at the other screen");
    await api(`${path}/show/${showing}`, {});
  }
  const ended = performance.now();
  const [vote, reaction_ms] = await ask(ended);
  await send(`${path}/vote`, { showing, vote, reaction_ms, clips: logs });
  return ended + 1000 * test.vote_s;
}

async function pauseBetween(before, presentation) {
  if (before === undefined) return;
  if (presentation.session !== before.session) {
    $("pause-title").textContent = "Time for a break.";
    $("pause-text").textContent = "Rest your eyes for some minutes, and tell the experimenter. Go on when you are ready.";
  } else if (before.kind === "training" && presentation.kind !== "training") {
    $("pause-title").textContent = "The training is over.";
    $("pause-text").textContent = "Now the test begins. If something is not clear, ask the experimenter now.";
  } else {
    return;
  }
  show("pause");
  await pressedButton($("go-on"));
}

async function run(test, refresh) {
  let notBefore = 0;
  let before;
  for (;;) {
    const presentation = await api("/api/next");
    if (presentation.done) break;
    await pauseBetween(before, presentation);
    notBefore = await present(presentation, test, refresh, notBefore);
    before = presentation;
  }
  releaseWindow();
  show("done");
  if (document.fullscreenElement) await document.exitFullscreen();
}

function describe(test) {
  if (test.title) document.title = test.title;
  $("times").textContent = test.times_shown > 1 ? "Each pair is shown twice; vote after the second time." : "";
  $("training").hidden = !test.training;
  $("again").hidden = !test.begun;
  if (test.instructions) {
    $("instructions").replaceChildren(...test.instructions.split(/\n\s*\n/).map((text) => {
      const paragraph = document.createElement("p");
      paragraph.textContent = text;
      return paragraph;
    }));
  }
  buildScale(test);
  canvas.width = test.width;
  canvas.height = test.height;
}

async function main() {
  try {
    await holdWindow();
    const test = await api("/api/session");
    describe(test);
    const refresh = measureRefresh();
    await fillForms(test, refresh);
    show("start");
    const ready = pressedButton($("begin"));
    refresh.then((hz) => {
      $("warning").textContent = ["", ...warnings(test, hz)].join(" For the experimenter: ").trim();
    });
    await ready;
    await fullScreen();
    await run(test, await refresh);
  } catch (error) {
    if (document.fullscreenElement) await document.exitFullscreen();
    $("what").textContent = error instanceof TypeError ? "The session's server does not answer." : error.message;
    show("problem");
    await pressedButton($("retry"));
    window.location.reload();
  }
}

main();
