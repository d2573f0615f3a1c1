// Brings the page to life: draws every figure, and gives it buttons, keys, a legend and a table.
(() => {
  const holder = document.getElementById("figures");
  if (!holder) return; // another page, which only wants the charts
  const { figures, columns } = JSON.parse(holder.textContent);
  Object.values(figures).forEach(unpack);
  const PRINTED_WIDTH = 720;
  const drawn = new Map();

  // Charts share lists of times, numbers and texts; a single number stands for equal ones.
  function unpack(figure) {
    const panels = (figure.timeline || figure).panels || [];
    for (const series of panels.flatMap((panel) => panel.series)) {
      const [x, y] = [columns[series.x], columns[series.y]];
      const at = (list, index) => list[list.length === 1 ? 0 : index];
      series.points = Array.from({ length: series.count }, (_, index) => [at(x, index), at(y, index)]);
      series.texts = columns[series.texts];
    }
  }

  function button(parent, label, text, act) {
    const element = parent.appendChild(document.createElement("button"));
    element.type = "button";
    element.textContent = text;
    element.title = label;
    element.setAttribute("aria-label", label);
    element.addEventListener("click", act);
  }

  const SHAPES = {
    line: "M1 8H27",
    step: "M1 12H10V4H19V12H27",
    band: "M1 2H27V14H1z",
    diamond: "M14 2l6 6-6 6-6-6z",
    triangle: "M14 2l6 11H8z",
    rect: "M9 3h10v10H9z",
    circle: "M14 3a5 5 0 1 0 .01 0z",
  };

  function swatch(entry, { shape, tone, opacity = 1, dashes = "" }) {
    const svg = entry.appendChild(document.createElementNS("http://www.w3.org/2000/svg", "svg"));
    svg.setAttribute("viewBox", "0 0 28 16");
    const mark = svg.appendChild(document.createElementNS(svg.namespaceURI, "path"));
    const line = shape === "line" || shape === "step";
    mark.setAttribute("d", SHAPES[shape]);
    mark.style.fill = line ? "none" : Charts.colour(tone);
    mark.style.stroke = line ? Charts.colour(tone) : "none";
    mark.style.strokeWidth = "3";
    mark.style.strokeDasharray = dashes;
    mark.style.opacity = opacity;
  }

  // What a chart shows, by name: its series, then what was expected, which is grey.
  function entries(figure) {
    const toneOf = Charts.tones(figure);
    const named = new Map();
    for (const series of figure.panels.flatMap((panel) => panel.series)) {
      const tone = toneOf(series);
      const shape = series.look === "dots" ? Charts.SYMBOLS[tone] || "circle" : series.look;
      named.set(`${series.name} ${tone}`, { name: series.name, shape, tone });
    }
    for (const { levels, bands } of figure.panels) {
      for (const { name } of levels) named.set(`level ${name}`, { name, shape: "line", tone: "faint", dashes: "6 4" });
      for (const { label, tone } of bands) {
        named.set(`band ${label}`, { name: label, shape: "band", tone: "faint", opacity: Charts.BANDS[tone] || 0.2 });
      }
    }
    return named.values();
  }

  function legend(parent, figure) {
    for (const entry of entries(figure)) {
      const element = parent.appendChild(document.createElement("span"));
      swatch(element, entry);
      element.appendChild(document.createElement("span")).textContent = entry.name;
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
    if (figure.cases.length) {
      const rows = figure.cases.map(({ start, stop, label }) => [Charts.number(start), Charts.number(stop), label]);
      table(parent, "Cases", [`from (${figure.x.unit})`, `to (${figure.x.unit})`, "case"], rows);
    }
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
    if (!place.hasChildNodes()) place.textContent = "No data.";
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
    button(parent, "Zoom in (+ key, or Ctrl and mouse wheel)", "+", () => picture.zoom(0.5));
    button(parent, "Zoom out (- key)", "\u2212", () => picture.zoom(2));
    if (panning) {
      button(parent, "Earlier", "\u2190", () => picture.pan(-0.5));
      button(parent, "Later", "\u2192", () => picture.pan(0.5));
    }
    button(parent, "Show all (0 key)", "All", () => picture.reset());
  }

  function open(element) {
    if (drawn.has(element)) return;
    const figure = figures[element.dataset.figure];
    const status = element.querySelector("[data-said]");
    const drawing = element.querySelector(".drawing");
    // Of the charts that share a cursor, only the one that is used speaks.
    const said = (words) => {
      if (status.textContent !== words && drawing.matches(":hover, :focus-within")) status.textContent = words;
    };
    const graph = figure.kind === "graph";
    const chart = figure.timeline || figure;
    const run = `${element.closest("section").id} ${chart.run}`;
    const picture = graph ? Graphs.draw(drawing, figure, said) : Charts.draw(drawing, chart, said, run);
    if (!graph) legend(element.querySelector(".legend"), chart);
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
      if (details.open && !place.hasChildNodes()) fill(place, chart);
    });
    drawn.set(element, picture);
    picture.run = run;
    if (figure.kind === "run") {
      // The charts of the criteria follow the player of their run.
      Player.open(element, figure, (moment) => {
        for (const other of drawn.values()) if (other.run === run && other.at) other.at(other.square ? moment.pose : moment);
      });
    }
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

  // Draws what has become visible; a folded chart costs nothing.
  function drawVisible() {
    for (const element of document.querySelectorAll("[data-figure]")) {
      if (!element.closest("details:not([open])")) open(element);
    }
  }

  // On paper every criterion has its words, and those that were unfolded their charts.
  let printing = false;
  let folded = [];
  function printed() {
    printing = true;
    folded = [...document.querySelectorAll("details.criterion:not([open])")];
    for (const details of folded) {
      details.classList.add("words");
      details.open = true;
    }
    for (const picture of drawn.values()) picture.paint(PRINTED_WIDTH, { slider: false, share: 0.55 });
  }
  function shownAgain() {
    for (const details of folded) {
      details.open = false;
      details.classList.remove("words");
    }
    for (const picture of drawn.values()) if (picture.width()) picture.paint(picture.width());
    printing = false;
  }

  // Foxglove loads a recording by its address only from a web server.
  if (location.protocol === "https:") {
    for (const link of document.querySelectorAll("[data-foxglove]")) {
      const address = new URL(link.dataset.foxglove, location.href).href;
      link.href = `https://app.foxglove.dev/~/view?ds=remote-file&ds.url=${encodeURIComponent(address)}`;
    }
  }

  drawVisible();
  document.addEventListener("toggle", () => { if (!printing) drawVisible(); }, true);
  window.addEventListener("beforeprint", printed);
  window.addEventListener("afterprint", shownAgain);
  window.addEventListener("hashchange", unfold);
  unfold();
  document.documentElement.dataset.ready = "yes";
})();
