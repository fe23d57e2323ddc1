// The results of the version that is shown, as a zip.

import { request } from "./api.js";
import { button, element, panel } from "./dom.js";

export function downloadPanel(model) {
  const problem = element("p", { class: "problem", role: "alert" });
  const note = element("p", { class: "soft" }, "Trajectories, loops, radio map, report and configuration of each floor.");
  const save = button("Download this version (zip)", async () => {
    problem.textContent = "";
    try {
      await download(model);
    } catch (error) {
      problem.textContent = error.message;
    }
  }, { id: "download" });
  const enable = () => { save.disabled = !model.shown; };
  model.addEventListener("versions", enable);
  enable();
  return panel("Results", true, note, save, problem);
}

// A link cannot send the key, so the file is fetched and then saved.
async function download(model) {
  const version = model.shown.version;
  const response = await request("GET", `${model.path}/maps/${version}/files`);
  const url = URL.createObjectURL(await response.blob());
  element("a", { href: url, download: `${model.info.id}-${version}.zip` }).click();
  setTimeout(() => URL.revokeObjectURL(url), 60000);
}
