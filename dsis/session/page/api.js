// The server: this window holds the session as long as one connection to it stays open.

import { $ } from "./dom.js";

const HANDING_OVER_MS = 3000; // a page that is reloaded still holds it for a moment

const leaving = new AbortController();
let token = "";

const pause = (ms) => new Promise((resolve) => { setTimeout(resolve, ms); });

export async function holdWindow() {
  const until = performance.now() + HANDING_OVER_MS;
  for (;;) {
    const answer = await fetch("/api/window", { signal: leaving.signal });
    if (answer.ok) {
      const { value } = await answer.body.getReader().read();
      token = new TextDecoder().decode(value).trim();
      return;
    }
    if (performance.now() > until) throw new Error((await answer.json()).error);
    await pause(100);
  }
}

export function releaseWindow() {
  leaving.abort();
}

async function answered(answer) {
  if (!answer.ok) throw new Error((await answer.json()).error);
  return answer;
}

export async function api(path, body) {
  const headers = { "X-Dsis-Window": token };
  const options = body === undefined ? { headers } : {
    method: "POST", headers: { ...headers, "Content-Type": "application/json" }, body: JSON.stringify(body),
  };
  return (await answered(await fetch(path, options))).json();
}

export async function bytesOf(path) {
  return (await answered(await fetch(path, { headers: { "X-Dsis-Window": token } }))).arrayBuffer();
}

// The server answers once the vote is on the disk; until then, the same vote is sent again.
export async function send(path, vote) {
  for (;;) {
    try {
      return await api(path, vote);
    } catch (error) {
      if (!(error instanceof TypeError)) throw error;
      $("saving").textContent = "Your vote is not stored yet: no answer. Trying again …";
      await pause(1000);
    }
  }
}
