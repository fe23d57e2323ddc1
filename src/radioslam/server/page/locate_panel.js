// Where was this scan made? Takes a scan as JSON, as `radioslam locate` does.

import { sendJson } from "./api.js";
import { element, form, labelled, panel } from "./dom.js";
import { metres, place } from "./format.js";

export class LocatePanel {
  constructor(model) {
    this.model = model;
    this.text = element("textarea", { id: "scan", rows: "4", spellcheck: "false", placeholder: '{"a0:b1:c2:d3:e4:f5": -61, …}', required: true });
    this.answer = element("p", { id: "position", role: "status" });
    const asked = form(() => this.ask(), "Where is this?", labelled("Scan: JSON of access point and strength in dBm", this.text));
    this.element = panel("Find a position", false, asked, this.answer);
  }

  async ask() {
    this.answer.textContent = "";
    const found = await sendJson("POST", `${this.model.path}/locate`, { readings: readings(this.text.value) });
    this.answer.textContent = found.here ? describe(found) : found.reason;
  }
}

function readings(text) {
  let scan;
  try {
    scan = JSON.parse(text);
  } catch (error) {
    throw new Error(`expected JSON of access point and strength, found: ${error.message}`);
  }
  if (scan === null || typeof scan !== "object" || Array.isArray(scan)) throw new Error("expected an object like {\"a0:b1:c2:d3:e4:f5\": -61}");
  return Object.entries(scan).map(([bssid, rssi_dbm]) => ({ bssid, rssi_dbm }));
}

function describe(found) {
  const floor = found.floor ? `, floor ${found.floor}` : "";
  const globe = found.latitude_deg === null ? "" : ` (${found.latitude_deg.toFixed(6)}, ${found.longitude_deg.toFixed(6)})`;
  return `${place(found.x_m, found.y_m)}${globe}${floor}, within ${metres(found.radius_m)} with 95 %`;
}
