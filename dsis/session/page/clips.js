// Clips: loaded and checked before they are shown, painted pixel for pixel, every frame logged.

import { bytesOf } from "./api.js";
import { $ } from "./dom.js";

const IN_FLIGHT = 3; // requests at a time: the next frames travel while one is checked

const canvas = $("screen");
const context = canvas.getContext("2d", { alpha: false, colorSpace: "srgb" });
const kept = new Map(); // hashes of a clip's frames -> its images, the last used at the end

export function paintGrey(test) {
  context.fillStyle = test.grey;
  context.fillRect(0, 0, canvas.width, canvas.height);
}

async function sha256(bytes) {
  const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", bytes));
  return Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

function imageOf(rgb, test) {
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

// Return the images of a clip of a presentation. References come again: what fits stays in memory.
export async function load(presentation, which, test) {
  const hashes = presentation.sha256[which];
  const shown = presentation.steps.find((step) => step.show === which).frames;
  const wanted = Math.min(shown, hashes.length);
  const key = `${wanted} ${hashes.join(" ")}`;
  const before = kept.get(key);
  kept.delete(key);
  for (const old of kept.keys()) {
    if (kept.size < test.clips_kept) break;
    kept.delete(old);
  }
  const images = before ?? new Array(wanted);
  kept.set(key, images);
  if (before) return images;
  let next = 0;
  const work = async () => {
    while (next < wanted) {
      const i = next++;
      const bytes = await bytesOf(`/api/presentations/${presentation.id}/${which}/${i}`);
      if ((await sha256(bytes)) !== hashes[i]) throw new Error(`Frame ${i} of the ${which} arrived damaged.`);
      images[i] = imageOf(new Uint8Array(bytes), test);
    }
  };
  try {
    await Promise.all(Array.from({ length: IN_FLIGHT }, work));
  } catch (error) {
    kept.delete(key);
    throw error;
  }
  return images;
}

// Paint a clip and return what was painted when; `frames` may exceed the images: they start again.
export function play(images, frames, which, test) {
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
        paintGrey(test);
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
