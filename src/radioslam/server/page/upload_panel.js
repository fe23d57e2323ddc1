// Uploads by dropping files or choosing them, one after another, each with its progress and what became of it.

import { element, panel } from "./dom.js";
import { bytes, many } from "./format.js";
import { sendFile } from "./send_file.js";

export class UploadPanel {
  constructor(model, onUploaded) {
    [this.model, this.onUploaded] = [model, onUploaded];
    this.queue = Promise.resolve();
    this.input = element("input", { type: "file", multiple: true, id: "upload", onchange: () => this.chosen() });
    this.list = element("ul", { class: "uploads", "aria-live": "polite" });
    this.element = panel("Upload walks", false, this.dropZone(), this.list);
  }

  dropZone() {
    const hint = "Any log that radioslam map reads, or a zip of logs; logs of several files go in a zip.";
    const zone = element("label", { class: "drop" }, element("strong", {}, "Drop logs here or choose them"), element("span", {}, hint), this.input);
    for (const kind of ["dragover", "dragleave", "drop"]) zone.addEventListener(kind, (event) => this.dragged(event, zone));
    return zone;
  }

  dragged(event, zone) {
    event.preventDefault();
    zone.classList.toggle("over", event.type === "dragover");
    if (event.type === "drop") this.add(event.dataTransfer.files);
  }

  chosen() {
    this.add(this.input.files);
    this.input.value = "";
  }

  add(files) {
    for (const file of files) {
      const item = this.item(file);
      this.queue = this.queue.then(() => this.send(file, item));
    }
  }

  item(file) {
    const item = { bar: element("progress", { max: "1", value: "0", "aria-label": `Upload of ${file.name}` }), told: element("span", {}, "waits") };
    this.list.prepend(element("li", {}, element("strong", {}, file.name), ` (${bytes(file.size)}) `, item.bar, item.told));
    return item;
  }

  async send(file, { bar, told }) {
    try {
      const answer = await sendFile(`${this.model.path}/files`, file, (part) => {
        bar.value = part;
        told.textContent = part < 1 ? `${Math.round(100 * part)} %` : "is read …";
      });
      told.textContent = describe(answer);
      told.className = "good";
      this.onUploaded();
    } catch (error) {
      told.textContent = error.message;
      told.className = "problem";
    }
    bar.hidden = true;
  }
}

function describe({ walks, duplicates, dropped_readings }) {
  const parts = [];
  if (walks.length) parts.push(`${many(walks.length, "walk")} taken in: ${walks.join(", ")}`);
  if (duplicates.length) parts.push(`${many(duplicates.length, "walk")} there before: ${duplicates.join(", ")}`);
  if (dropped_readings) parts.push(`${many(dropped_readings, "reading")} of networks that opted out dropped`);
  return parts.join("; ");
}
