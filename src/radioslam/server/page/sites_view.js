// The list of sites, and for admins a form for another.

import { getJson, sendJson } from "./api.js";
import { element, form, labelled, panel, table } from "./dom.js";
import { count, MISSING } from "./format.js";

const STARTS = {
  unknown: "unknown: found from the scans",
  common: "common: all begin at one place",
  known: "known: each log tells its first position",
  mixed: "mixed: some logs tell positions",
};

export async function showSites(caller) {
  const sites = await getJson("sites");
  const none = element("p", {}, "There is no site yet. ", element("code", {}, "radioslam replay"), " makes one, or the form below.");
  const list = table("Sites", ["site", "name", "walks", "map version"], sites.map(siteRow));
  const elements = [element("h1", {}, "Sites"), sites.length ? list : none];
  if (caller.role === "admin") elements.push(panel("New site", !sites.length, newSite()));
  return { title: "Sites", elements, leave() {} };
}

function siteRow(site) {
  const link = element("a", { href: `#/sites/${site.id}` }, site.title || site.id);
  return [link, site.id, count(site.walks), site.map_version ?? MISSING];
}

function newSite() {
  const id = element("input", { required: true, pattern: "[a-z0-9][a-z0-9\\-]{0,62}", title: "a-z, 0-9 and -" });
  const title = element("input", { maxlength: "100" });
  const starts = element("select", {}, ...Object.entries(STARTS).map(([value, text]) => element("option", { value }, text)));
  const heading = element("input", { type: "checkbox" });
  return form(
    async () => {
      const made = { id: id.value, title: title.value, starts: starts.value, heading: heading.checked ? "unknown" : "device" };
      await sendJson("POST", "sites", made);
      location.hash = `#/sites/${made.id}`;
    },
    "Make the site",
    labelled("Short name (a-z, 0-9, -)", id), labelled("Title", title), labelled("Where walks begin", starts),
    element("label", { class: "check" }, heading, "Phones were carried in pockets (their heading is not that of the walker)"),
  );
}
