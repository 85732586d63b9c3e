// Debian's Chromium for a test; the test is skipped where it or the page is not there.
import {existsSync} from 'node:fs';
import {chromium} from 'playwright-core';

export {chromium};

// `optional`: nothing then, instead.
export function executable(optional = false) {
  const executablePath = ['/usr/bin/chromium', '/usr/bin/chromium-browser'].find(existsSync);
  if (!executablePath) {
    if (optional) return null;
    console.log('skipped: Chromium is not installed (Debian package chromium)');
    process.exit(77);
  }
  if (!existsSync(`${process.env.TAKT_BIN}/../share/takt/view/index.html`)) {
    if (optional) return null;
    console.log('skipped: the page was not built, since npm could not be reached');
    process.exit(77);
  }
  return {executablePath, args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader']};
}
