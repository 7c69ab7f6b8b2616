import { describe, expect, it } from 'vitest';
import { Problem } from '../api/problem';
import type { ProgramEntry } from '../api/types';
import { KeptPrograms } from './kept.svelte';
import type { Instruction, Program } from './program';

const wait = (duration: number): Instruction => ({ kind: 'wait', duration });

/** A service that keeps programs, and refuses what the test says. */
function service() {
  const kept = new Map<string, { program: Program; revision: number }>();
  const sent: string[] = [];
  const entry = (name: string): ProgramEntry =>
    ({ name, revision: kept.get(name)!.revision, changed: String(sent.length) }) as ProgramEntry;
  const found = {
    kept,
    sent,
    refusal: null as Problem | null,
    hold: null as Promise<void> | null,
    requests: {
      list: () => Promise.resolve([...kept.keys()].reverse().map(entry)),
      load: (name: string) => Promise.resolve({ entry: entry(name), program: kept.get(name)!.program }),
      async put(name: string, program: Program, revision: number | null) {
        await found.hold;
        if (found.refusal) throw found.refusal;
        sent.push(`${name} ${revision} ${program.instructions.length}`);
        kept.delete(name);
        kept.set(program.name, { program, revision: (revision ?? 0) + 1 });
        return entry(program.name);
      },
      remove: (name: string) => Promise.resolve(void kept.delete(name)),
    },
  };
  return found;
}

describe('programs that the service keeps', () => {
  it('are there again for whoever comes back', async () => {
    const { requests } = service();
    const first = new KeptPrograms('arm', requests);
    await first.start();
    await first.change([wait(1), wait(2)]);
    const again = new KeptPrograms('arm', requests);
    await again.start();
    expect([again.name, again.instructions, again.isKept]).toEqual(['taught', [wait(1), wait(2)], true]);
  });

  it('take every change, one after the other, with the revision that it changes', async () => {
    const found = service();
    const programs = new KeptPrograms('arm', found.requests);
    await programs.start();
    let letGo = (): void => {};
    found.hold = new Promise((done) => (letGo = done));
    const first = programs.change([wait(1)]);
    await programs.change([wait(1), wait(2)]);
    expect(programs.isKept).toBe(false);
    letGo();
    await first;
    expect(found.sent).toEqual(['taught null 1', 'taught 1 2']);
    expect(programs.isKept).toBe(true);
  });

  it('are renamed, not doubled', async () => {
    const found = service();
    const programs = new KeptPrograms('arm', found.requests);
    await programs.start();
    await programs.change([wait(1)]);
    await programs.rename('pick');
    expect([...found.kept.keys()]).toEqual(['pick']);
    expect(programs.entries.map((one) => one.name)).toEqual(['pick']);
  });

  it('are shown as not kept where the service refuses, and are kept by the next try', async () => {
    const found = service();
    const programs = new KeptPrograms('arm', found.requests);
    await programs.start();
    found.refusal = new Problem(409, 'program-changed', 'changed by bert meanwhile');
    await programs.change([wait(1)]);
    expect([programs.isKept, programs.problem?.kind]).toEqual([false, 'program-changed']);
    found.refusal = null;
    await programs.keep();
    expect([programs.isKept, programs.problem]).toEqual([true, null]);
  });

  it('are kept as new ones where somebody else has deleted them', async () => {
    const found = service();
    const programs = new KeptPrograms('arm', found.requests);
    await programs.start();
    await programs.change([wait(1)]);
    found.refusal = new Problem(404, 'not-found', 'there is no program');
    await programs.change([wait(1), wait(2)]);
    expect([programs.isKept, programs.open]).toEqual([false, null]);
    found.refusal = null;
    await programs.keep();
    expect(found.sent.at(-1)).toBe('taught null 2');
    expect(programs.isKept).toBe(true);
  });

  it('begin under a name that is free, and are gone once deleted', async () => {
    const found = service();
    const programs = new KeptPrograms('arm', found.requests);
    await programs.start();
    await programs.change([wait(1)]);
    programs.begin();
    expect([programs.name, programs.instructions]).toEqual(['taught-2', []]);
    await programs.change([wait(2)]);
    await programs.load('taught');
    await programs.remove();
    expect([...found.kept.keys()]).toEqual(['taught-2']);
    expect([programs.open, programs.name]).toEqual([null, 'taught']);
  });
});
