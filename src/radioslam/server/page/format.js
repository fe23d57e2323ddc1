// Numbers with units, as people read them.

export const MISSING = "–";

function known(show) {
  return (value) => (value === null || value === undefined || !Number.isFinite(value) ? MISSING : show(value));
}

export const metres = known((value) => `${value.toFixed(1)} m`);
export const count = known((value) => value.toLocaleString("en"));
export const decibels = known((value) => `${value.toFixed(0)} dB`);
export const clock = known((time_s) => new Date(1000 * time_s).toLocaleString("en-GB", { dateStyle: "medium", timeStyle: "medium" }));
export const bytes = known((value) => (value < 1e6 ? `${(value / 1e3).toFixed(0)} kB` : `${(value / 1e6).toFixed(1)} MB`));

export function place(x_m, y_m) {
  return `x ${x_m.toFixed(1)} m, y ${y_m.toFixed(1)} m`;
}

export function many(number, noun) {
  return `${count(number)} ${noun}${number === 1 ? "" : "s"}`;
}
