// Elements of text and attributes; names that came from elsewhere only ever become text.

export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) give(made, name, value);
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

function give(made, name, value) {
  if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
  else if (value === true) made.setAttribute(name, "");
  else if (value !== false && value !== null && value !== undefined) made.setAttribute(name, value);
}

export function button(text, onclick, attributes = {}) {
  return element("button", { type: "button", onclick, ...attributes }, text);
}

export function labelled(text, input) {
  return element("label", {}, element("span", {}, text), input);
}

export function table(caption, columns, rows) {
  const head = element("tr", {}, ...columns.map((column) => element("th", { scope: "col" }, column)));
  return element("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": caption },
    element("table", {}, element("caption", {}, caption), element("thead", {}, head),
      element("tbody", {}, ...rows.map(tableRow))));
}

function tableRow(cells) {
  const [first, ...rest] = cells;
  return element("tr", {}, element("th", { scope: "row" }, first), ...rest.map((cell) => element("td", {}, cell)));
}

export function panel(title, open, ...children) {
  return element("details", { class: "panel", open },
    element("summary", {}, element("h2", {}, title)), element("div", { class: "inside" }, ...children));
}

// A form whose sending cannot leave the page; what goes wrong is said below it.
export function form(onsend, sendLabel, ...children) {
  const problem = element("p", { class: "problem", role: "alert" });
  const send = element("button", { type: "submit", class: "main" }, sendLabel);
  const made = element("form", {}, ...children, element("div", { class: "buttons" }, send), problem);
  made.addEventListener("submit", async (event) => {
    event.preventDefault();
    problem.textContent = "";
    send.disabled = true;
    try {
      await onsend();
    } catch (error) {
      problem.textContent = error.message;
    }
    send.disabled = false;
  });
  return made;
}
