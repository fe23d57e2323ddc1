// The walks of the site; admins may leave a bad one out of the next map, and take it back.

import { getJson, sendJson } from "./api.js";
import { button, element, panel, table } from "./dom.js";
import { bytes } from "./format.js";

export class WalksPanel {
  constructor(model, caller) {
    [this.model, this.caller] = [model, caller];
    this.place = element("div", { id: "walks" });
    this.problem = element("p", { class: "problem", role: "alert" });
    this.element = panel("Walks", false, this.problem, this.place);
  }

  async refresh() {
    const walks = await getJson(`${this.model.path}/walks`);
    const columns = ["walk", "state", "device", "floor", "size", ...(this.mayChange ? ["in the map"] : [])];
    const shown = walks.length ? table("Walks of this site", columns, walks.map((walk) => this.row(walk))) : element("p", {}, "None yet.");
    this.place.replaceChildren(shown);
  }

  get mayChange() {
    return this.caller.role === "admin";
  }

  row(walk) {
    const cells = [walk.name, walk.state, walk.device, walk.floor, bytes(walk.size_bytes)];
    if (!this.mayChange) return cells;
    const isOut = walk.state === "withdrawn";
    const words = isOut ? "take back" : "leave out";
    return [...cells, button(words, () => this.withdraw(walk.name, isOut), { "aria-label": `${words}: ${walk.name}` })];
  }

  async withdraw(name, restore) {
    this.problem.textContent = "";
    try {
      await sendJson("POST", `${this.model.path}/walks/${encodeURIComponent(name)}/withdraw?restore=${restore}`);
      await this.refresh();
    } catch (error) {
      this.problem.textContent = error.message;
    }
  }
}
