// Server-sent events by fetch, because the browser's EventSource cannot send a key in a header.

import { address, refusal } from "./api.js";
import { keyHeaders } from "./key_store.js";

const LONGEST_PAUSE_MS = 15000;
const pause = (ms) => new Promise((done) => setTimeout(done, ms));

// Watches until the returned function is called; `onState` is told "live", "away", or why it is refused.
export function watchEvents(path, onEvent, onState) {
  const ending = new AbortController();
  follow(path, onEvent, onState, ending.signal);
  return () => ending.abort();
}

async function follow(path, onEvent, onState, signal) {
  let last = 0; // so that the first time brings what the service remembers
  let pause_ms = 500;
  while (!signal.aborted) {
    try {
      const response = await open(path, last, signal);
      if (response.status >= 400 && response.status < 500) return onState(refusal(response.status, await response.text()).message);
      if (!response.ok) throw new Error(response.statusText);
      onState("live");
      pause_ms = 500;
      for await (const event of parse(response.body)) {
        last = event.id ?? last;
        if (!signal.aborted) onEvent(event.kind, event.data);
      }
    } catch (error) {
      if (signal.aborted) return;
      if (!(error instanceof TypeError || error.name === "Error")) throw error;
    }
    if (signal.aborted) return;
    onState("away");
    await pause(pause_ms);
    pause_ms = Math.min(2 * pause_ms, LONGEST_PAUSE_MS);
  }
}

function open(path, last, signal) {
  const headers = { ...keyHeaders(), Accept: "text/event-stream", "Last-Event-ID": String(last) };
  return fetch(address(path), { headers, signal, cache: "no-store" });
}

async function* parse(stream) {
  const reader = stream.pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return;
    text = (text + value).replaceAll("\r\n", "\n");
    const blocks = text.split("\n\n");
    text = blocks.pop();
    for (const event of blocks.map(parseBlock)) if (event) yield event;
  }
}

function parseBlock(block) {
  const fields = { data: [] };
  for (const line of block.split("\n")) {
    const [, name, value] = /^([^:]*):? ?(.*)$/.exec(line);
    if (name === "data") fields.data.push(value);
    else fields[name] = value;
  }
  if (!fields.data.length) return null;
  return { id: fields.id, kind: fields.event ?? "message", data: JSON.parse(fields.data.join("\n")) };
}
