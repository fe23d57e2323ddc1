// Asks for the API key and keeps the one that the service knows.

import { getJson } from "./api.js";
import { storedKey, storeKey } from "./key_store.js";

const part = (name) => document.getElementById(`key-${name}`);

export function setUpKeyDialog(onChange) {
  part("button").addEventListener("click", open);
  part("cancel").addEventListener("click", () => part("dialog").close());
  part("forget").addEventListener("click", () => use(null, onChange));
  part("dialog").querySelector("form").addEventListener("submit", (event) => {
    event.preventDefault();
    tryKey(part("input").value.trim(), onChange);
  });
  document.addEventListener("keyneeded", open);
}

function open() {
  if (part("dialog").open) return;
  part("input").value = "";
  part("problem").textContent = storedKey() ? "The service does not know this key (any more)." : "";
  part("dialog").showModal();
}

async function tryKey(key, onChange) {
  const before = storedKey();
  storeKey(key);
  try {
    await getJson("key");
  } catch (error) {
    storeKey(before);
    part("problem").textContent = error.status === 401 ? "The service does not know this key." : error.message;
    part("input").select();
    return;
  }
  use(key, onChange);
}

function use(key, onChange) {
  storeKey(key);
  part("input").value = "";
  part("dialog").close();
  onChange();
}
