// A site as the service has it: its versions, the one that is looked at, and what was asked of it before.
// Tells listeners "versions" (which there are, and which is chosen) and "map" (another version or floor is shown).

import { getJson } from "./api.js";

const KEPT_ANSWERS = 60;

export class SiteModel extends EventTarget {
  constructor(info) {
    super();
    this.info = info;
    this.versions = []; // the oldest first
    this.shown = null;
    this.floor = null;
    this.followsNewest = true;
    this.answers = new Map();
  }

  get path() {
    return `sites/${this.info.id}`;
  }

  get newest() {
    return this.versions.at(-1) ?? null;
  }

  get floors() {
    return this.shown ? this.shown.summary.floors : [];
  }

  // Names what is shown: answers that come when it is something else are of the past.
  get showing() {
    return `${this.shown?.version} ${this.floor}`;
  }

  async refreshInfo() {
    this.info = await getJson(this.path);
  }

  async refreshVersions() {
    this.versions = (await getJson(`${this.path}/maps`)).reverse();
    const still = this.versions.find((one) => one.version === this.shown?.version);
    this.choose(this.followsNewest || !still ? this.newest : still);
  }

  choose(version, floor = this.floor) {
    this.followsNewest = version === this.newest;
    const names = version ? version.summary.floors.map((one) => one.floor) : [];
    const kept = names.includes(floor) ? floor : names[0] ?? null;
    const before = this.showing;
    [this.shown, this.floor] = [version, kept];
    this.dispatchEvent(new Event("versions"));
    if (this.showing !== before) this.dispatchEvent(new Event("map"));
  }

  // A view of the version that is shown; versions never change, so each is asked once.
  view(name, parameters = {}) {
    if (!this.shown || !this.floors.length) return Promise.resolve(null);
    const path = `${this.path}/maps/${this.shown.version}/${name}`;
    const asked = JSON.stringify([path, this.floor, parameters]);
    if (!this.answers.has(asked)) this.ask(asked, path, { ...parameters, floor: this.floor });
    return this.answers.get(asked);
  }

  ask(asked, path, parameters) {
    const answer = getJson(path, parameters);
    answer.catch(() => this.answers.delete(asked));
    this.answers.set(asked, answer);
    if (this.answers.size > KEPT_ANSWERS) this.answers.delete(this.answers.keys().next().value);
  }
}
