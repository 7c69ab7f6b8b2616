import { describe, expect, it } from 'vitest';
import { Problem } from '../api/problem';
import { GainTable, type Gains } from './gains.svelte';

const HELD: Gains = { 1: [2, 0, 0], 2: [4, 0, 1] };

async function table(write: (gains: Gains) => Promise<Gains> = () => Promise.resolve(HELD)) {
  const written: Gains[] = [];
  const found = new GainTable({
    read: () => Promise.resolve(HELD),
    write: (gains) => {
      written.push(gains);
      return write(gains);
    },
  });
  await found.read();
  return { found, written };
}

describe('the gains', () => {
  it('are written for the joints that were changed alone, and shown as they were read back', async () => {
    const { found, written } = await table(() => Promise.resolve({ ...HELD, 2: [5, 0, 1] }));
    expect([found.changed, found.isWritable]).toEqual([[], false]);
    found.typed['2']![0] = '6';
    await found.write();
    expect(written).toEqual([{ 2: [6, 0, 1] }]);
    expect(found.typed['2']).toEqual(['5', '0', '1']);
    expect([found.changed, found.done]).toEqual([[], 'joint 2: written and read back']);
  });

  it.each(['', '21', '-1', '1.5', 'x'])('are not written with %j in a field', async (typed) => {
    const { found, written } = await table();
    found.typed['1']![2] = typed;
    expect(found.wrong('1', 2)).not.toBe('');
    await found.write();
    expect(written).toEqual([]);
  });

  it('say which joints nothing would hold', async () => {
    const { found } = await table();
    found.typed['1']![0] = '0';
    expect(found.limp).toEqual(['1']);
  });

  it('stay in the fields where the service refuses', async () => {
    const { found } = await table(() => Promise.reject(new Problem(409, 'refused', 'joint 1 would jump')));
    found.typed['1']![0] = '9';
    await found.write();
    expect([found.typed['1']![0], found.problem?.detail, found.done]).toEqual([
      '9',
      'joint 1 would jump',
      '',
    ]);
  });
});
