// Findings of axe-core on a page: those that are serious, with the elements.
import {createRequire} from 'node:module';
import {readFileSync} from 'node:fs';

const source = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');

export async function findings(page) {
  await page.evaluate(source);
  const {violations} = await page.evaluate(() => axe.run(document, {resultTypes: ['violations']}));
  return violations.filter(({impact}) => impact === 'serious' || impact === 'critical')
    .map(({id, help, nodes}) => `${id}: ${help}: ${nodes.map(({target, failureSummary}) => `${target} (${failureSummary.split('\n')[1]?.trim()})`).join('; ')}`);
}
