// The display: its clock, and that one pixel of the clip is one pixel of the screen.

import { $ } from "./dom.js";

export const vsync = () => new Promise((resolve) => { requestAnimationFrame(resolve); });

export async function until(time) {
  let now = performance.now();
  while (now < time) now = await vsync();
}

const INTERVALS = 60; // a second or less; the median of fewer would wander

export async function measureRefresh() {
  const intervals = [];
  let before = await vsync();
  for (let i = 0; i < INTERVALS; i++) {
    const now = await vsync();
    intervals.push(now - before);
    before = now;
  }
  intervals.sort((a, b) => a - b);
  return 1000 / intervals[INTERVALS / 2];
}

export function lay(canvas, test) {
  const ratio = window.devicePixelRatio;
  const [width, height] = [Math.round(window.innerWidth * ratio), Math.round(window.innerHeight * ratio)];
  canvas.style.width = `${test.width / ratio}px`;
  canvas.style.height = `${test.height / ratio}px`;
  canvas.style.left = `${Math.floor((width - test.width) / 2) / ratio}px`;
  canvas.style.top = `${Math.floor((height - test.height) / 2) / ratio}px`;
  if (width < test.width || height < test.height) {
    throw new Error(`The clips have ${test.width} x ${test.height} pixels, this window ${width} x ${height}.`
      + " Use the full screen (F11), zoom 100 % (Ctrl 0), or a larger display.");
  }
}

export function measured(refresh) {
  return {
    refresh_hz: refresh,
    device_pixel_ratio: window.devicePixelRatio,
    window_px: [window.innerWidth, window.innerHeight],
    screen_px: [window.screen.width, window.screen.height],
    full_screen: document.fullscreenElement !== null
      || (window.innerWidth === window.screen.width && window.innerHeight === window.screen.height),
    visible: !document.hidden,
    browser: navigator.userAgent,
  };
}

const FULL_SCREEN_MS = 2000;

export function fullScreen() {
  // Refused by some browsers, never answered where there is no window manager: then the window's
  // size decides, in lay().
  const waited = new Promise((resolve) => { setTimeout(resolve, FULL_SCREEN_MS); });
  const asked = document.documentElement.requestFullscreen?.({ navigationUI: "hide" }).catch(() => {});
  return Promise.race([asked, waited]);
}

// What an experimenter should know, as sentences.
export function warnings(test, refresh) {
  const found = [];
  if (test.player !== "page") return found;
  const ratio = refresh / test.fps;
  if (Math.abs(ratio - Math.round(ratio)) > 0.02 * ratio || ratio < 0.98) {
    found.push(`This display shows ${refresh.toFixed(1)} pictures a second, no multiple of the clips' ${test.fps}.`
      + " Motion will be uneven, and the votes say so.");
  }
  if (window.devicePixelRatio !== 1) {
    found.push(`The page is zoomed (${window.devicePixelRatio} pixels for one). Clips are shown pixel for pixel`
      + " all the same; set zoom and scaling to 100 % to be sure.");
  }
  return found;
}

const DARK = [0, 3, 6, 9, 12, 16];
const CELL = 56;

// Steps next to black and next to white; lines and squares one pixel wide, which a display that
// scales shows with bands, or as grey.
export function drawPattern(canvas) {
  const ratio = window.devicePixelRatio;
  canvas.width = 2 * DARK.length * CELL;
  canvas.height = 2 * CELL;
  canvas.style.width = `${canvas.width / ratio}px`;
  canvas.style.height = `${canvas.height / ratio}px`;
  const context = canvas.getContext("2d", { alpha: false });
  DARK.forEach((step, i) => {
    for (const [code, left] of [[step, i * CELL], [255 - step, (DARK.length + i) * CELL]]) {
      context.fillStyle = `rgb(${code} ${code} ${code})`;
      context.fillRect(left, 0, CELL, CELL);
    }
  });
  const image = context.createImageData(canvas.width, CELL);
  const white = [(x) => x % 2, (x, y) => y % 2, (x, y) => (x + y) % 2];
  for (let y = 0, at = 0; y < CELL; y++) {
    for (let x = 0; x < canvas.width; x++, at += 4) {
      const code = 255 * white[Math.floor(3 * x / canvas.width)](x, y);
      image.data.set([code, code, code, 255], at);
    }
  }
  context.putImageData(image, 0, CELL);
}

export function listMeasured(test, facts) {
  const lines = [
    `${facts.refresh_hz.toFixed(2)} pictures a second; the clips have ${test.fps}`,
    `window ${facts.window_px.join(" x ")}, screen ${facts.screen_px.join(" x ")}, clips ${test.width} x ${test.height}`,
    ...warnings(test, facts.refresh_hz),
  ];
  $("measured").replaceChildren(...lines.map((line) => {
    const item = document.createElement("li");
    item.textContent = line;
    return item;
  }));
}
