// Debian's Chromium for a test; the test is skipped where it or the page is not there.
import {existsSync} from 'node:fs';
import {chromium as stock} from 'playwright-core';

// On a loaded machine a page may take its time: navigations and clicks wait as long as conditions do.
const PATIENCE_MS = 300000;
// Pixels of the screen for one of the layout: places and sizes on a page are those of the layout, and the processor that draws
// here draws a quarter of the pixels. Tests whose subject are pixels, and pictures for the docs, have all of them.
export const ALL_PIXELS = 1;
const SCALE = process.env.TAKT_SCREENSHOT ? ALL_PIXELS : 0.5;
const patient = (browser) => {
  for (const name of ['newPage', 'newContext']) {
    const make = browser[name].bind(browser);
    browser[name] = async (options) => {
      const made = await make({deviceScaleFactor: SCALE, ...options});
      made.setDefaultTimeout(PATIENCE_MS);
      return made;
    };
  }
  return browser;
};
export const chromium = {launch: async (options) => patient(await stock.launch(options))};

// What a pointer shows depends on the places of things, and a page that draws seldom may have moved them since they were
// measured: the act (which measures, moves, and may be done again) is repeated until its effect is there.
export async function point(page, act, condition, argument) {
  for (const end = Date.now() + PATIENCE_MS; ; ) {
    await act();
    try {
      return await page.waitForFunction(condition, argument, {timeout: 3000, polling: 50});
    } catch (error) {
      if (Date.now() > end) throw new Error(`${error.message}\nno effect of the pointer: ${condition}`);
    }
  }
}

// Opens the page of takt view once it shows a cell: the page, and short words for what tests do with it. What it says of
// errors is kept in `problems`. `prepare`: what is done to the page before it loads.
export async function visit(browser, url, viewport = {width: 900, height: 560}, {prepare = () => {}, ...options} = {}) {
  const page = await (await browser.newContext({viewport, acceptDownloads: true, ...options})).newPage();
  await prepare(page);
  const problems = [];
  page.on('pageerror', (error) => problems.push(error.stack));
  page.on('console', (message) => { if (message.type() === 'error' && !message.text().includes('WebSocket')) problems.push(message.text()); });
  const until = (condition, argument) => page.waitForFunction(condition, argument, {timeout: PATIENCE_MS, polling: 50}).catch(async (error) => {
    throw new Error(`${error.message}\nwaited for ${condition} with ${JSON.stringify(argument)}\nthe page says: ${await page.locator('body').innerText()}`);
  });
  const ask = (what, argument) => page.evaluate(what, argument);
  await page.goto(url);
  await until(() => takt.last.state && takt.last.status && takt.cell.frames > 0);
  // The picture of the cell alone, without the tools in front of it, once what was asked for is drawn: PNG in base64.
  const pixels = () => page.evaluate(async () => {
    const end = performance.now() + 5000;  // a cell that moves does not settle
    do await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
    while (!takt.cell.settled && performance.now() < end);
    return document.querySelector('#cell').toDataURL('image/png').split(',')[1];
  });
  return {page, problems, until, ask, pixels};
}

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
