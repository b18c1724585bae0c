// The rail from the side, millimetres: soft limits, switches, carriage, reference.

const SVG = "http://www.w3.org/2000/svg";
const SWITCHES = [["left", -240], ["centre", 0], ["right", 240], ["optical", 178]];
const SOFT = 220;
const STOP = 300;

export class Rail {
  constructor(svg) {
    const add = (tag, attributes, text = "") => {
      const shape = document.createElementNS(SVG, tag);
      for (const [name, value] of Object.entries(attributes)) shape.setAttribute(name, value);
      shape.textContent = text;
      svg.append(shape);
      return shape;
    };
    add("rect", { class: "beam", x: -STOP - 20, y: 4, width: 2 * STOP + 40, height: 8, rx: 3 });
    add("rect", { class: "soft", x: -SOFT, y: 4, width: 2 * SOFT, height: 8 });
    for (const end of [-STOP - 20, STOP + 12]) add("rect", { class: "beam", x: end, y: -22, width: 8, height: 34 });
    for (let mark = -200; mark <= 200; mark += 100) add("text", { x: mark, y: 42 }, `${(mark / 1000).toFixed(1)} m`);
    this.switches = SWITCHES.map(([name, x]) => {
      const lamp = add("circle", { class: "switch", cx: x, cy: 21, r: 5 });
      lamp.append(document.createElementNS(SVG, "title"));
      lamp.firstChild.textContent = `${name} switch`;
      return lamp;
    });
    this.reference = add("line", { class: "reference", x1: 0, x2: 0, y1: -40, y2: 4 });
    this.cart = add("rect", { class: "cart", x: -30, y: -28, width: 60, height: 30, rx: 4 });
  }

  show(rig) {
    const at = (metres) => `translate(${((metres ?? 0) * 1000).toFixed(2)} 0)`;
    this.cart.setAttribute("transform", at(rig.position));
    this.reference.setAttribute("transform", at(rig.reference));
    this.switches.forEach((lamp, i) => lamp.classList.toggle("pressed", Boolean(rig.switches[i])));
  }
}
