// How the service stands: live or away, what the map's making does, and which walks come in.

import { getJson, sendJson } from "./api.js";
import { button, element, panel } from "./dom.js";
import { many } from "./format.js";

export class StatusPanel {
  constructor(model, arrivals, caller) {
    [this.model, this.arrivals] = [model, arrivals];
    this.stream = element("p", { id: "stream", role: "status" }, "connecting …");
    this.build = element("p", { id: "build", role: "status" });
    this.problem = element("p", { class: "problem", role: "alert" });
    this.coming = element("ul", { id: "arriving", class: "arriving" });
    const again = caller.role === "admin" ? button("Make the map again", () => this.again()) : null;
    this.element = panel("Now", true, this.stream, this.build, again, this.problem, this.coming);
  }

  async refresh() {
    this.showBuild(await getJson(`${this.model.path}/build`));
  }

  async again() {
    this.problem.textContent = "";
    try {
      this.showBuild(await sendJson("POST", `${this.model.path}/build`));
    } catch (error) {
      this.problem.textContent = error.message;
    }
  }

  showStream(state) {
    const words = { live: "Live: the page follows what happens.", away: "The service does not answer; trying again …" };
    this.stream.textContent = words[state] ?? state;
    this.stream.dataset.state = words[state] ? state : "refused";
  }

  showBuild({ state, step, wanted, message }) {
    const words = { idle: "A new map is made when walks change.", running: `The map is being made: ${step || "beginning"} …`, failed: `The map could not be made: ${message}` };
    this.build.textContent = wanted && state === "idle" ? "The map will be made soon." : words[state];
    this.build.classList.toggle("problem", state === "failed");
  }

  showArrivals() {
    const open = [...this.arrivals.walks].filter(([, walk]) => walk.state === "open");
    this.coming.replaceChildren(...open.map(([name, walk]) => element("li", {}, `${name}: ${many(walk.scans, "scan")}, ${many(walk.poses.length, "pose")} so far`)));
  }
}
