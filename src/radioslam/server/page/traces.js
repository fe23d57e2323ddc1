// Pieces of Plotly traces that several layers share.

const CIRCLE = Array.from({ length: 25 }, (_, k) => [Math.cos((k * Math.PI) / 12), Math.sin((k * Math.PI) / 12)]);

// Plotly reads marks in texts; names are shown as they are.
export function plain(text) {
  return String(text).replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll(">", "&gt;");
}

// One line of many: [{x, y, text}] joined with breaks between them.
export function broken(lines) {
  const joined = { x: [], y: [], text: [] };
  for (const line of lines) {
    joined.x.push(...line.x, null);
    joined.y.push(...line.y, null);
    joined.text.push(...(line.text ?? line.x.map(() => "")), "");
  }
  return joined;
}

export function ellipse(x_m, y_m, radius_x_m, radius_y_m) {
  return { x: CIRCLE.map(([c]) => x_m + radius_x_m * c), y: CIRCLE.map(([, s]) => y_m + radius_y_m * s) };
}

export function drawn(style, points) {
  return { type: "scatter", hovertemplate: "%{text}<extra></extra>", ...style, ...points };
}

// The least and the largest of any number of values.
export function extent(values) {
  return values.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]);
}
