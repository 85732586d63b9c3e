// Small helpers of the page's panels.
const SVG = 'http://www.w3.org/2000/svg';
export const $ = (id) => document.getElementById(id);
// `kind`: the name of an element, of SVG with svg: in front.
export const make = (kind, text = '', attributes = {}) => {
  const made = kind.startsWith('svg:') ? document.createElementNS(SVG, kind.slice(4)) : document.createElement(kind);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.textContent = text;
  return made;
};
// The answer to a request; where it takes long, say() gets the seconds. takt view refuses when the server is silent.
export function counted(answer, say) {
  const begun = performance.now(), timer = setInterval(() => say(`The server is at work: ${Math.round((performance.now() - begun) / 1000)} s`), 1000);
  return answer.finally(() => clearInterval(timer));
}
export const three = ({x, y, z}, factor, digits) => [x, y, z].map((value) => (factor * value).toFixed(digits).replace(/^-(0\.?0*)$/, '$1')).join('  ');  // no -0.00
// Roll, pitch and yaw of a quaternion in degrees.
export function angles({x, y, z, w}) {
  const deg = 180 / Math.PI;
  return {x: deg * Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)), y: deg * Math.asin(Math.max(-1, Math.min(1, 2 * (w * y - z * x)))), z: deg * Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))};
}
// An empty field is no number: NaN, which a request has as null, and the server refuses it.
export const numberOf = ({value}) => (value.trim() === '' ? NaN : Number(value));
