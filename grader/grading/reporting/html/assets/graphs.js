// Draws the figures of kind "graph": nodes as ellipses, topics as boxes, services and actions as hexagons, and arrows
// for who publishes and who subscribes, who calls and who answers.
const Graphs = (() => {
  const SVG = "http://www.w3.org/2000/svg";
  // A graph that is LEAST times as wide as its place is made smaller, and no more than that if it can be avoided.
  const [GLYPH, HEIGHT, NARROW, LEAST] = [7.9, 36, 560, 1.15];

  function make(parent, tag, attributes, text) {
    const element = parent.appendChild(document.createElementNS(SVG, tag));
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    if (text !== undefined) element.textContent = text;
    return element;
  }

  function boxesOf(stage) {
    return [...stage.nodes, ...stage.topics, ...stage.services];
  }

  // The layout. On a phone boxes that would lie side by side are put below each other until their text can be read.
  function arranged(stage, width) {
    if (width >= NARROW) return laidOut(stage, false, 1);
    const tried = [1, 2, 3].map((steps) => laidOut(stage, true, steps));
    return tried.find((one) => one.width <= width * LEAST) || tried.reduce((a, b) => (b.width < a.width ? b : a));
  }

  function laidOut(stage, upright, steps) {
    const graph = new dagre.graphlib.Graph({ multigraph: true });
    const gaps = upright ? { rankdir: "TB", marginx: 6, nodesep: 12, edgesep: 8, ranksep: 30 } : { rankdir: "LR", marginx: 14, nodesep: 26, ranksep: 46 };
    graph.setGraph({ marginy: 14, ...gaps });
    graph.setDefaultEdgeLabel(() => ({}));
    for (const box of boxesOf(stage)) {
      const wide = (box.kind === "topic" ? 22 : 38) - (upright ? 8 : 0);
      graph.setNode(box.id, { width: [...box.name].length * GLYPH + wide, height: HEIGHT });
    }
    const order = new Map([...stage.topics, ...stage.services].map((box, index) => [box.id, index]));
    const far = ({ from, to }) => 1 + ((order.get(from) ?? order.get(to)) % steps);
    stage.edges.forEach((edge, index) => {
      graph.setEdge(edge.from, edge.to, { text: edge.text, minlen: far(edge) }, String(index));
    });
    dagre.layout(graph);
    return { graph, ...extent(graph) };
  }

  // The layout counts boxes only, and arrows may go around them.
  function extent(graph) {
    const [points, { width, height }] = [graph.edges().flatMap((key) => graph.edge(key).points), graph.graph()];
    const ends = (axis, most) => [Math.min(0, ...points.map((p) => p[axis] - 8)), Math.max(most, ...points.map((p) => p[axis] + 8))];
    const [[left, right], [top, bottom]] = [ends("x", width), ends("y", height)];
    return { left, top, width: right - left, height: bottom - top };
  }

  // Where the line from an ellipse's centre towards a point leaves it; the layout knows rectangles only.
  function onEdge(place, toward) {
    const [dx, dy] = [toward.x - place.x, toward.y - place.y];
    const length = Math.hypot(dx / (place.width / 2), dy / (place.height / 2)) || 1;
    return { x: place.x + dx / length, y: place.y + dy / length };
  }

  function touching(graph, key, points) {
    const ends = [...points];
    if (key.v.startsWith("n")) ends[0] = onEdge(graph.node(key.v), points[1]);
    if (key.w.startsWith("n")) ends[ends.length - 1] = onEdge(graph.node(key.w), points[points.length - 2]);
    return ends;
  }

  function curve(points) {
    const at = (p) => `${p.x.toFixed(1)} ${p.y.toFixed(1)}`;
    let path = `M${at(points[0])}`;
    for (let k = 1; k < points.length - 1; k += 1) {
      const middle = { x: (points[k].x + points[k + 1].x) / 2, y: (points[k].y + points[k + 1].y) / 2 };
      path += `Q${at(points[k])} ${at(k === points.length - 2 ? points[k + 1] : middle)}`;
    }
    return points.length === 2 ? `${path}L${at(points[1])}` : path;
  }

  function arrowHead(points) {
    const [before, tip] = points.slice(-2);
    const angle = (Math.atan2(tip.y - before.y, tip.x - before.x) * 180) / Math.PI;
    return { d: "M0 0L-9 4.5L-9 -4.5Z", class: "tipped", transform: `translate(${tip.x} ${tip.y}) rotate(${angle})` };
  }

  function drawBox(picture, place, box) {
    const node = box.kind === "node";
    const types = node ? "" : box.quarrel || box.types.join(", ");
    const group = make(picture, "g", {
      class: `${box.kind}${box.quarrel ? " quarrel" : ""}`,
      "data-box": box.id,
      tabindex: "0",
      role: "img",
      "aria-label": `${box.kind} ${box.name}${types ? `, ${types}` : ""}`,
      transform: `translate(${place.x} ${place.y})`,
    });
    const [w, h] = [place.width, place.height];
    make(group, "title", {}, node ? box.name : `${box.kind} ${box.name}\n${types}`);
    if (node) make(group, "ellipse", { class: "box", rx: w / 2, ry: h / 2 });
    else if (box.kind !== "topic") make(group, "path", { class: "box", d: `M${-w / 2} 0L${11 - w / 2} ${-h / 2}H${w / 2 - 11}L${w / 2} 0L${w / 2 - 11} ${h / 2}H${11 - w / 2}Z` });
    else make(group, "rect", { class: "box", x: -w / 2, y: -h / 2, width: w, height: h, rx: 4 });
    make(group, "text", {}, box.name);
    return group;
  }

  function drawStage(parent, stage, width, said) {
    const section = parent.appendChild(document.createElement("div"));
    section.className = "stage";
    if (stage.title) section.appendChild(document.createElement("h5")).textContent = stage.title;
    const canvas = section.appendChild(document.createElement("div"));
    canvas.className = "canvas";
    const { graph, ...size } = arranged(stage, width);
    section.style.flex = `1 1 ${Math.min(Math.ceil(size.width) + 2, width)}px`;
    const picture = make(canvas, "svg", { viewBox: `${size.left} ${size.top} ${size.width} ${size.height}`, role: "group", "aria-label": stage.title || "ROS graph" });
    const edges = graph.edges().map((key) => {
      const { text, alive } = stage.edges[Number(key.name)];
      const laid = graph.edge(key).points;
      const points = touching(graph, key, laid);
      const group = make(picture, "g", { class: "edge", "data-from": key.v, "data-to": key.w });
      make(group, "title", {}, text);
      make(group, "path", { class: "arrow", d: curve(points) });
      make(group, "path", arrowHead(points));
      return { group, text, alive, from: key.v, to: key.w };
    });
    const groups = {};
    for (const box of boxesOf(stage)) groups[box.id] = drawBox(picture, graph.node(box.id), box);
    highlight(groups, edges, said);
    const resize = (scale) => {
      const fit = Math.min(1, Math.max(canvas.clientWidth - 2, 120) / size.width);
      picture.setAttribute("width", size.width * fit * scale);
      picture.setAttribute("height", size.height * fit * scale);
    };
    return { resize, groups, edges };
  }

  // Draws everything that is ever in the graph of a run; returns what shows only what is there at a moment.
  function live(element, stage, said) {
    let drawn = null;
    function paint() {
      element.replaceChildren();
      drawn = drawStage(element, stage, element.clientWidth || 480, said);
      drawn.resize(1);
    }
    // Moment: index of the last change of the graph. Busy: names of the topics on which something was just published.
    function at(moment, busy) {
      const isBusy = ({ kind, name }) => kind === "topic" && busy.has(name);
      const boxes = boxesOf(stage);
      for (const box of boxes) {
        drawn.groups[box.id].classList.toggle("absent", !box.alive.includes(moment));
        drawn.groups[box.id].classList.toggle("busy", isBusy(box));
      }
      for (const { group, alive, from, to } of drawn.edges) {
        const target = boxes.find((box) => box.id === (from.startsWith("n") ? to : from));
        group.classList.toggle("absent", !alive.includes(moment));
        group.classList.toggle("busy", isBusy(target) && alive.includes(moment));
      }
    }
    paint();
    return { paint, at };
  }

  // Lights up what a box under the pointer or the focus is connected to.
  function highlight(groups, edges, said) {
    for (const [id, group] of Object.entries(groups)) {
      const light = (on) => {
        const near = edges.filter((edge) => edge.from === id || edge.to === id);
        const kept = new Set([id, ...near.flatMap((edge) => [edge.from, edge.to])]);
        for (const edge of edges) {
          edge.group.classList.toggle("lit", on && near.includes(edge));
          edge.group.classList.toggle("dim", on && !near.includes(edge));
        }
        for (const [other, box] of Object.entries(groups)) box.classList.toggle("dim", on && !kept.has(other));
        if (on) said(near.map((edge) => edge.text).join("; ") || group.getAttribute("aria-label"));
      };
      for (const name of ["pointerenter", "focus"]) group.addEventListener(name, () => light(true));
      for (const name of ["pointerleave", "blur"]) group.addEventListener(name, () => light(false));
    }
  }

  function draw(element, figure, said) {
    let scale = 1;
    let sizers = [];
    function paint(width) {
      element.replaceChildren();
      const stages = element.appendChild(document.createElement("div"));
      stages.className = "stages";
      sizers = figure.stages.map((stage) => drawStage(stages, stage, width, said).resize);
      sizers.forEach((size) => size(scale));
    }
    function rescale(value) {
      scale = Math.min(Math.max(value, 1), 6);
      sizers.forEach((size) => size(scale));
    }
    paint(element.clientWidth || 640);
    return {
      paint,
      zoom: (factor) => rescale(scale / factor),
      reset: () => rescale(1),
      pan: () => {},
      step: () => {},
      hide: () => {},
      width: () => element.clientWidth,
    };
  }

  return { draw, live };
})();
