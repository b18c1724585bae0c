// An orientation as a small board in space: x (red) along the rail, y (green) across it, z (blue) up, seen from a corner.

const HALF = [1.25, 0.8, 0.12];
const FACES = [[0, 1], [0, -1], [1, 1], [1, -1], [2, 1], [2, -1]];
const AXES = ["#c62828", "#2e7d32", "#1565c0"];
const VIEW = (() => { // seen from the right, the front and above
  const turn = (-35 * Math.PI) / 180;
  const down = (28 * Math.PI) / 180;
  const [c, s, C, S] = [Math.cos(turn), Math.sin(turn), Math.cos(down), Math.sin(down)];
  return ([x, y, z]) => {
    const across = c * x - s * y;
    const away = s * x + c * y;
    return [across, S * away + C * z, C * away - S * z]; // right, up, depth
  };
})();

function rotate([w, x, y, z], [a, b, c]) {
  const [tx, ty, tz] = [2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)];
  return [a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx];
}

/** Draw the board; `q` null clears the canvas. */
export function drawBox(canvas, q) {
  const density = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth * density, canvas.clientHeight * density].map(Math.round);
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const pen = canvas.getContext("2d");
  pen.clearRect(0, 0, width, height);
  if (q === null) return;
  const scale = Math.min(width / 4.4, height / 3.4);
  const place = (p) => {
    const [right, up, depth] = VIEW(p);
    return [width / 2 + scale * right, height / 2 - scale * up, depth];
  };
  ground(pen, place, density);
  const faces = FACES.map(([axis, side]) => face(q, axis, side, place)).sort((a, b) => b.depth - a.depth);
  pen.lineWidth = density;
  for (const { corners, normalUp, top } of faces) {
    path(pen, corners);
    const shade = Math.round(150 + 60 * Math.max(-1, Math.min(1, normalUp)));
    pen.fillStyle = top ? "#4f9d69" : `rgb(${shade}, ${shade + 6}, ${shade + 14})`;
    pen.strokeStyle = "#3b4754";
    pen.fill();
    pen.stroke();
  }
  AXES.forEach((colour, axis) => arrow(pen, place, q, axis, colour, density));
}

function path(pen, corners) {
  pen.beginPath();
  corners.forEach(([x, y], i) => (i ? pen.lineTo(x, y) : pen.moveTo(x, y)));
  pen.closePath();
}

function ground(pen, place, density) {
  pen.strokeStyle = "#e3e7ec";
  pen.lineWidth = density;
  path(pen, [[-1.8, -1.2, -0.5], [1.8, -1.2, -0.5], [1.8, 1.2, -0.5], [-1.8, 1.2, -0.5]].map(place));
  pen.stroke();
}

function face(q, axis, side, place) {
  const [u, v] = [0, 1, 2].filter((i) => i !== axis);
  const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([a, b]) => {
    const p = [0, 0, 0];
    p[axis] = side * HALF[axis];
    p[u] = a * HALF[u];
    p[v] = b * HALF[v];
    return place(rotate(q, p));
  });
  const normal = [0, 0, 0];
  normal[axis] = side;
  const centre = normal.map((n, i) => n * HALF[i]);
  return {
    corners,
    depth: place(rotate(q, centre))[2],
    normalUp: rotate(q, normal)[2],
    top: axis === 2 && side === 1,
  };
}

function arrow(pen, place, q, axis, colour, density) {
  const tip = [0, 0, 0];
  tip[axis] = axis === 2 ? 1 : HALF[axis] + 0.45;
  const root = [0, 0, 0];
  root[axis] = HALF[axis];
  const [a, b] = [place(rotate(q, root)), place(rotate(q, tip))];
  pen.strokeStyle = colour;
  pen.lineWidth = 2.5 * density;
  pen.beginPath();
  pen.moveTo(a[0], a[1]);
  pen.lineTo(b[0], b[1]);
  pen.stroke();
}
