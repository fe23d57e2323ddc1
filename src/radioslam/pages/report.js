(function () {
  var dark = window.matchMedia("(prefers-color-scheme: dark)");
  var canvas = document.createElement("canvas");
  var webgl = canvas.getContext("webgl2") || canvas.getContext("webgl");
  function colours() {
    var style = getComputedStyle(document.documentElement);
    return { ink: style.getPropertyValue("--ink").trim(), line: style.getPropertyValue("--line").trim(),
             page: style.getPropertyValue("--page").trim(), tint: style.getPropertyValue("--tint").trim() };
  }
  function narrow(figure, width) {
    figure.layout.height = Math.max(340, 150 + (figure.layout.height - 110) * width / 1050);
    figure.layout.margin = { l: 60, r: 10, t: 40, b: 50 };
    figure.data.forEach(function (trace) {
      var bar = trace.marker && trace.marker.colorbar;
      if (bar) Object.assign(bar, { orientation: "h", x: 0.5, y: -0.12, yanchor: "top", len: 1,
                                    title: { text: bar.title.text, side: "bottom" } });
    });
  }
  function dress(figure, width) {
    var c = colours(), layout = figure.layout;
    if (width < 700) narrow(figure, width);
    figure.data.forEach(function (trace) {
      if (trace.meta === "ink") trace.line.color = c.ink;
      if (!webgl && trace.type === "scattergl") trace.type = "scatter";
    });
    layout.paper_bgcolor = c.page; layout.plot_bgcolor = c.page;
    layout.legend = Object.assign({ bgcolor: "rgba(0,0,0,0)" }, layout.legend);
    layout.font = { color: c.ink, family: "system-ui, Roboto, Helvetica, Arial, sans-serif", size: 13 };
    layout.hoverlabel = { bgcolor: c.tint, bordercolor: c.line, font: { color: c.ink } };
    Object.keys(layout).filter(function (k) { return /^[xy]axis/.test(k); }).forEach(function (k) {
      layout[k].gridcolor = c.line; layout[k].linecolor = c.line;
    });
    (layout.updatemenus || []).forEach(function (m) { m.bgcolor = c.tint; m.bordercolor = c.line; });
    return figure;
  }
  function draw() {
    document.querySelectorAll("script[type='application/json']").forEach(function (source) {
      var place = source.previousElementSibling;
      var figure = dress(JSON.parse(source.textContent), place.clientWidth);
      place.style.height = figure.layout.height + "px";
      Plotly.react(place, figure.data, figure.layout,
                   { responsive: true, displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d"],
                     displayModeBar: place.clientWidth < 700 ? false : "hover" });
    });
  }
  draw();
  dark.addEventListener("change", draw);
})();
