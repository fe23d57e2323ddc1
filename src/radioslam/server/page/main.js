// Starts the page: whose key it is, and which view the address asks for.

import { getJson } from "./api.js";
import { element } from "./dom.js";
import { setUpKeyDialog } from "./key_dialog.js";
import { showSite } from "./site_view.js";
import { showSites } from "./sites_view.js";

const place = document.getElementById("main");
const whose = document.getElementById("whose");
let leave = () => {};
let turn = 0;

async function show() {
  const mine = ++turn;
  leave();
  leave = () => {};
  place.replaceChildren(element("p", { class: "soft" }, "Loading …"));
  try {
    const caller = await getJson("key");
    whose.textContent = `${caller.name} (${caller.role})`;
    const [, site] = /^#\/sites\/(.+)$/.exec(location.hash) ?? [];
    const view = site ? await showSite(decodeURIComponent(site), caller) : await showSites(caller);
    if (mine !== turn) return view.leave();
    leave = view.leave;
    place.replaceChildren(...view.elements);
    document.title = `${view.title} – RadioSLAM`;
  } catch (error) {
    if (mine !== turn) return;
    whose.textContent = "";
    const words = error.status === 401 ? "This service needs an API key." : error.message;
    place.replaceChildren(element("p", { class: "problem", role: "alert" }, words));
  }
}

setUpKeyDialog(show);
window.addEventListener("hashchange", () => location.hash !== "#main" && show());
show();
