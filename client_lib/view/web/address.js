// The view that an address asks for. Its text may have any form: what is no view is left out.
const numbers = (value) => (Array.isArray(value) && value.length === 3 && value.every((one) => Number.isFinite(one) && Math.abs(one) < 1e6) ? value : undefined);

// {camera, target, section, cut, options, plots}: undefined where the address has none.
export function addressed(hash) {
  let found = null;
  try { found = JSON.parse(decodeURIComponent(hash.slice(1)) || '{}'); } catch { /* it is no view */ }
  const {camera, target, section, cut, options, plots} = found && typeof found === 'object' ? found : {}, at = numbers(camera), to = numbers(target);
  return {...(at && to && at.some((value, i) => value !== to[i]) ? {camera: at, target: to} : {}), section: ['x', 'y', 'z'].includes(section) ? section : '', cut: Number.isFinite(cut) ? cut : 0,
    options: options && typeof options === 'object' ? options : {}, plots: Array.isArray(plots) ? plots : undefined};
}
