// Colours of the map: those of the report, and scales for what is measured.

export const WALKS = [
  "#3b7dd8", "#e8743b", "#1fa774", "#b0479a", "#c9a227", "#d64550",
  "#5a9bd4", "#8a6fdf", "#6b8e23", "#d4699e", "#2a9d9d", "#a0693b",
];
export const ODOMETRY = "#9a9a9a";
export const TRUTH = "#222222";
export const ARRIVING = "#d1700a";
export const GAP = "#c0362c";
export const POSITION = "#7a1fa2";

const STOPS = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
export const VIRIDIS = STOPS.map((stop, k) => [k / (STOPS.length - 1), `rgb(${stop.join(",")})`]);

export function viridis(part) {
  const at = Math.min(Math.max(part, 0), 1) * (STOPS.length - 1);
  const low = Math.min(Math.floor(at), STOPS.length - 2);
  const mixed = STOPS[low].map((value, k) => Math.round(value + (at - low) * (STOPS[low + 1][k] - value)));
  return `rgb(${mixed.join(",")})`;
}
