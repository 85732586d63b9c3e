// Files of a plot: the numbers as CSV, the picture as SVG, and as PNG of the same drawing.

const place = (value) => Number(value.toFixed(2));
const escaped = (text) => text.replace(/[&<>"]/g, (sign) => `&#${sign.charCodeAt(0)};`);
const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);

// data: times, and a column for each curve {name, unit, label, color, dash}; of the times from..to. An empty field: no number.
export function csvOf(curves, data, from, to) {
  const lines = [['time [s]', ...curves.map(({name, unit}) => (unit ? `${name} [${unit}]` : name))].map(quoted).join()];
  data[0].forEach((time, i) => {
    if (time >= from && time <= to) lines.push([time, ...data.slice(1).map((column) => column[i] ?? '')].join());
  });
  return `${lines.join('\n')}\n`;
}

// About `count` round numbers between two.
export function ticksOf(low, high, count) {
  const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough)), step = [1, 2, 5, 10].map((one) => one * power).find((one) => one >= rough * 0.999);
  const first = Math.ceil(low / step - 1e-9);
  return Array.from({length: Math.floor(high / step + 1e-9) - first + 1}, (one, i) => Number(((first + i) * step).toPrecision(12)));
}

// `gaps`: whether the line goes from the sample before this one.
export function svgOf(curves, data, from, to, {ink, ground, line}, gaps = () => false) {
  const width = 900, height = 380, left = 70, right = 70, top = 24 + 18 * curves.length, low = height - 44;
  const units = [...new Set(curves.map(({unit}) => unit))], x = (time) => place(left + (time - from) / Math.max(to - from, 1e-12) * (width - left - right));
  const ranges = units.map((unit) => {
    let least = Infinity, most = -Infinity;
    curves.forEach((curve, k) => { if (curve.unit === unit) data[0].forEach((time, i) => { const value = data[k + 1][i]; if (time >= from && time <= to && value !== null && value !== undefined) { least = Math.min(least, value); most = Math.max(most, value); } }); });
    if (!(least <= most)) return [0, 1];
    const room = (most - least) * 0.05 || Math.abs(most) * 0.1 || 1;
    return [least - room, most + room];
  });
  const y = (value, axis) => place(low - (value - ranges[axis][0]) / (ranges[axis][1] - ranges[axis][0]) * (low - top));
  const text = (at, down, words, anchor = 'middle', more = '') => `<text x="${at}" y="${down}" text-anchor="${anchor}"${more}>${escaped(words)}</text>`;
  const parts = [`<rect width="${width}" height="${height}" fill="${ground}"/>`];
  for (const tick of ticksOf(from, to, 8)) parts.push(`<path d="M${x(tick)} ${top}V${low}" stroke="${line}"/>`, text(x(tick), low + 18, String(tick)));
  parts.push(text((left + width - right) / 2, height - 8, 'time, s'));
  ranges.forEach(([least, most], axis) => {
    const side = axis ? width - right : left;
    for (const tick of ticksOf(least, most, 6)) {
      if (!axis) parts.push(`<path d="M${left} ${y(tick, axis)}H${width - right}" stroke="${line}"/>`);
      parts.push(text(side + (axis ? 6 : -6), y(tick, axis) + 4, String(tick), axis ? 'start' : 'end'));
    }
    parts.push(text(side, top - 8, units[axis] || '1', axis ? 'end' : 'start'));
  });
  curves.forEach((curve, k) => {
    let path = '', up = true;
    data[0].forEach((time, i) => {
      const value = data[k + 1][i];
      if (value === undefined) return;
      if (value === null || time < from || time > to) { up = true; return; }
      path += `${up || gaps(curve, time) ? 'M' : 'L'}${x(time)} ${y(value, units.indexOf(curve.unit))}`;
      up = false;
    });
    const dash = curve.dash.length ? ` stroke-dasharray="${curve.dash.join(' ')}"` : '', row = 16 + 18 * k;
    parts.push(`<path d="${path}" fill="none" stroke="${curve.color}" stroke-width="1.75" stroke-linejoin="round"${dash}/>`,
      `<path d="M${left} ${row - 4}h26" stroke="${curve.color}" stroke-width="3"${dash}/>`, text(left + 32, row, `${curve.label}${curve.unit ? `, ${curve.unit}` : ''}`, 'start'));
  });
  return `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" viewBox="0 0 ${width} ${height}" font-family="system-ui, sans-serif" font-size="12" fill="${ink}">${parts.join('')}</svg>`;
}

export async function pngOf(svg) {
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svg)}`;
  await image.decode();
  const canvas = document.createElement('canvas');
  Object.assign(canvas, {width: 2 * image.width, height: 2 * image.height});
  canvas.getContext('2d').drawImage(image, 0, 0, canvas.width, canvas.height);
  return new Promise((done) => canvas.toBlob(done, 'image/png'));
}

export function download(blob, name) {
  const link = Object.assign(document.createElement('a'), {download: name, href: URL.createObjectURL(blob)});
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);  // some browsers read it only after the click
}
