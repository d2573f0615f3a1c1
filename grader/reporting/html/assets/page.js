// Brings the page to life: draws every figure, and gives it buttons, keys, a legend and a table.
(() => {
  const holder = document.getElementById("figures");
  if (!holder) return; // another page, which only wants the charts
  const figures = JSON.parse(holder.textContent);
  const PRINTED_WIDTH = 660;
  const drawn = [];

  function button(parent, label, text, act) {
    const element = parent.appendChild(document.createElement("button"));
    element.type = "button";
    element.textContent = text;
    element.title = label;
    element.setAttribute("aria-label", label);
    element.addEventListener("click", act);
  }

  function swatch(entry, series) {
    const svg = entry.appendChild(document.createElementNS("http://www.w3.org/2000/svg", "svg"));
    svg.setAttribute("viewBox", "0 0 28 16");
    const dots = {
      diamond: "M14 2l6 6-6 6-6-6z",
      triangle: "M14 2l6 11H8z",
      rect: "M9 3h10v10H9z",
      circle: "M14 3a5 5 0 1 0 .01 0z",
    };
    const steps = "M1 12H10V4H19V12H27";
    const mark = svg.appendChild(document.createElementNS(svg.namespaceURI, "path"));
    const line = series.look !== "dots";
    mark.setAttribute("d", line ? (series.look === "step" ? steps : "M1 8H27") : dots[Charts.SYMBOLS[series.tone] || "circle"]);
    mark.style.fill = line ? "none" : Charts.colour(series.tone);
    mark.style.stroke = line ? Charts.colour(series.tone) : "none";
    mark.style.strokeWidth = "3";
  }

  function legend(parent, figure) {
    const seen = new Set();
    for (const series of (figure.panels || []).flatMap((panel) => panel.series)) {
      const key = `${series.name} ${series.tone} ${series.look}`;
      if (seen.has(key)) continue;
      seen.add(key);
      const entry = parent.appendChild(document.createElement("span"));
      swatch(entry, series);
      entry.appendChild(document.createElement("span")).textContent = series.name;
    }
  }

  function table(parent, caption, heads, rows) {
    const element = parent.appendChild(document.createElement("table"));
    element.createCaption().textContent = caption;
    const add = (row, tag, text) => {
      const cell = row.appendChild(document.createElement(tag));
      cell.textContent = text;
      return cell;
    };
    const top = element.createTHead().insertRow();
    for (const head of heads) add(top, "th", head).scope = "col";
    const body = element.createTBody();
    for (const row of rows) {
      const line = body.insertRow();
      for (const value of row) add(line, "td", value).className = /^[-\d.e+]+$/.test(value) ? "num" : "";
    }
  }

  function chartTables(parent, figure) {
    for (const panel of figure.panels) {
      for (const series of panel.series) {
        const text = series.texts.length > 0;
        const axis = panel.lanes.length ? "row" : `${panel.title}${panel.unit ? ` (${panel.unit})` : ""}`;
        const rows = series.points.map(([x, y], index) => [
          Charts.number(x),
          panel.lanes.length ? panel.lanes[y] : Charts.number(y),
          ...(text ? [series.texts[index]] : []),
        ]);
        const heads = [`${figure.x.title} (${figure.x.unit})`, axis, ...(text ? ["text"] : [])];
        table(parent, series.name, heads, rows);
      }
    }
  }

  function fill(place, figure) {
    (figure.kind === "graph" ? graphTables : chartTables)(place, figure);
    if (!place.hasChildNodes()) place.textContent = "There is nothing in it.";
  }

  function graphTables(parent, figure) {
    for (const stage of figure.stages) table(parent, stage.title, ["connection"], stage.edges.map((edge) => [edge.text]));
  }

  const KEYS = {
    ArrowRight: (picture) => picture.step(1),
    ArrowLeft: (picture) => picture.step(-1),
    "+": (picture) => picture.zoom(0.5),
    "=": (picture) => picture.zoom(0.5),
    "-": (picture) => picture.zoom(2),
    0: (picture) => picture.reset(),
    Escape: (picture) => picture.hide(),
  };

  function tools(parent, picture, panning) {
    button(parent, "Zoom in (plus key, or ctrl and wheel)", "+", () => picture.zoom(0.5));
    button(parent, "Zoom out (minus key)", "\u2212", () => picture.zoom(2));
    if (panning) {
      button(parent, "Earlier", "\u2190", () => picture.pan(-0.5));
      button(parent, "Later", "\u2192", () => picture.pan(0.5));
    }
    button(parent, "Show all (0 key)", "All", () => picture.reset());
  }

  function open(element) {
    const figure = figures[element.dataset.figure];
    const status = element.querySelector("[data-said]");
    const said = (words) => { if (status.textContent !== words) status.textContent = words; };
    const drawing = element.querySelector(".drawing");
    const graph = figure.kind === "graph";
    const picture = (graph ? Graphs : Charts).draw(drawing, figure, said);
    legend(element.querySelector(".legend"), figure);
    tools(element.querySelector(".tools"), picture, !graph && !figure.square);
    drawing.addEventListener("keydown", (event) => {
      const act = KEYS[event.key];
      if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      act(picture);
    });
    const details = element.querySelector(".table");
    details.addEventListener("toggle", () => {
      const place = details.querySelector(".scroll");
      if (details.open && !place.hasChildNodes()) fill(place, figure);
    });
    drawn.push(picture);
    watch(drawing, picture);
  }

  function watch(drawing, picture) {
    let width = drawing.clientWidth;
    new ResizeObserver(() => {
      if (printing || !drawing.clientWidth || drawing.clientWidth === width) return;
      width = drawing.clientWidth;
      picture.paint(width);
    }).observe(drawing);
  }

  // A link to something folded away unfolds it.
  function unfold() {
    const target = location.hash && document.getElementById(location.hash.slice(1));
    const folded = target && target.closest("details");
    if (folded) folded.open = true;
  }

  let printing = false;
  let folded = [];
  function printed() {
    printing = true;
    folded = [...document.querySelectorAll("details.criterion:not([open])")];
    for (const details of folded) details.open = true;
    for (const picture of drawn) picture.paint(PRINTED_WIDTH);
  }
  function shownAgain() {
    for (const details of folded) details.open = false;
    for (const picture of drawn) picture.paint(picture.width());
    printing = false;
  }

  for (const element of document.querySelectorAll("[data-figure]")) open(element);
  window.addEventListener("beforeprint", printed);
  window.addEventListener("afterprint", shownAgain);
  window.addEventListener("hashchange", unfold);
  unfold();
  document.documentElement.dataset.ready = "yes";
})();
