// The floor image under the map: loaded to be drawn, and by admins laid in with its size in metres.

import { request } from "./api.js";
import { element, form, labelled, panel } from "./dom.js";

// The image as Plotly wants it, or none.
export async function loadPlan(model) {
  if (!model.info.has_plan) return [];
  const response = await request("GET", `${model.path}/plan`);
  const [pixel_m, x, y] = ["X-Pixel-M", "X-Corner-X-M", "X-Corner-Y-M"].map((name) => Number(response.headers.get(name)));
  const source = await dataUrl(await response.blob());
  const { naturalWidth, naturalHeight } = await decoded(source);
  return [{ source, x, y, xref: "x", yref: "y", xanchor: "left", yanchor: "top", sizex: naturalWidth * pixel_m, sizey: naturalHeight * pixel_m, sizing: "stretch", layer: "below", opacity: 0.6 }];
}

export function planPanel(model, onChange) {
  const number = (value) => element("input", { type: "number", step: "any", value, required: true });
  const [file, width_m, x, y] = [element("input", { type: "file", accept: "image/png,image/jpeg", required: true, id: "plan-file" }), number("50"), number("0"), number("0")];
  width_m.min = "0.1";
  const send = async () => {
    const image = file.files[0];
    const { naturalWidth, naturalHeight } = await decoded(await dataUrl(image));
    const pixel_m = Number(width_m.value) / naturalWidth;
    const parameters = { pixel_m, corner_x_m: x.value, corner_y_m: Number(y.value) + pixel_m * naturalHeight };
    await request("PUT", `${model.path}/plan`, { parameters, body: image, headers: { "Content-Type": image.type } });
    await onChange();
  };
  return panel("Floor image", false, form(send, "Lay it under the map",
    labelled("Image (PNG or JPEG, north up as the map's y)", file), labelled("Width of the image in metres", width_m),
    labelled("Its lower left corner: x in metres", x), labelled("y in metres", y)));
}

function dataUrl(blob) {
  return new Promise((done, failed) => {
    const reader = new FileReader();
    reader.addEventListener("load", () => done(reader.result));
    reader.addEventListener("error", () => failed(new Error("the file cannot be read")));
    reader.readAsDataURL(blob);
  });
}

async function decoded(source) {
  const image = new Image();
  image.src = source;
  try {
    await image.decode();
  } catch {
    throw new Error("expected a PNG or JPEG image, found something that is none");
  }
  return image;
}
