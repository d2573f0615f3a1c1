// Draws the figures of kind "graph": nodes as ellipses, topics as boxes, arrows for who publishes and who subscribes.
const Graphs = (() => {
  const SVG = "http://www.w3.org/2000/svg";
  const [GLYPH, HEIGHT, NARROW] = [7.9, 36, 560];

  function make(parent, tag, attributes, text) {
    const element = parent.appendChild(document.createElementNS(SVG, tag));
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    if (text !== undefined) element.textContent = text;
    return element;
  }

  function arranged(stage, upright) {
    const graph = new dagre.graphlib.Graph({ multigraph: true });
    graph.setGraph({ rankdir: upright ? "TB" : "LR", nodesep: 26, ranksep: upright ? 34 : 46, marginx: 14, marginy: 14 });
    graph.setDefaultEdgeLabel(() => ({}));
    for (const box of [...stage.nodes, ...stage.topics]) {
      const wide = box.id.startsWith("n") ? 38 : 22;
      graph.setNode(box.id, { width: [...box.name].length * GLYPH + wide, height: HEIGHT });
    }
    stage.edges.forEach((edge, index) => graph.setEdge(edge.from, edge.to, { text: edge.text }, String(index)));
    dagre.layout(graph);
    return graph;
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
    const node = box.id.startsWith("n");
    const group = make(picture, "g", {
      class: `${node ? "node" : "topic"}${box.quarrel ? " quarrel" : ""}`,
      "data-box": box.id,
      tabindex: "0",
      role: "img",
      "aria-label": node ? `node ${box.name}` : `topic ${box.name}, ${box.types.join(" and ")}`,
      transform: `translate(${place.x} ${place.y})`,
    });
    const [w, h] = [place.width, place.height];
    const said = node ? box.name : `${box.name}\n${box.quarrel ? "types differ: " : ""}${box.types.join(", ")}`;
    make(group, "title", {}, said);
    if (node) make(group, "ellipse", { class: "box", rx: w / 2, ry: h / 2 });
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
    const graph = arranged(stage, width < NARROW);
    const size = graph.graph();
    section.style.flex = `1 1 ${Math.min(Math.ceil(size.width) + 2, width)}px`;
    const picture = make(canvas, "svg", { viewBox: `0 0 ${size.width} ${size.height}`, role: "group", "aria-label": stage.title || "ROS graph" });
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
    for (const box of [...stage.nodes, ...stage.topics]) groups[box.id] = drawBox(picture, graph.node(box.id), box);
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
      const boxes = [...stage.nodes, ...stage.topics];
      for (const { id, name, alive } of boxes) {
        drawn.groups[id].classList.toggle("absent", !alive.includes(moment));
        drawn.groups[id].classList.toggle("busy", busy.has(name) && id.startsWith("t"));
      }
      for (const { group, alive, from, to } of drawn.edges) {
        const topic = boxes.find((box) => box.id === (from.startsWith("t") ? from : to));
        group.classList.toggle("absent", !alive.includes(moment));
        group.classList.toggle("busy", busy.has(topic.name) && alive.includes(moment));
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
