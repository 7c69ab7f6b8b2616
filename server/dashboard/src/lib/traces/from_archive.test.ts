import { describe, expect, it } from 'vitest';
import { Problem } from '../api/problem';
import { fromArchive } from './from_archive';

const away = new Problem(503, 'trace-in-archive', 'it is being fetched: 0.4 of 0.9 MB');

/** Fails as told, one after the other, then gives 'the trace'. */
function request(...failures: Problem[]): () => Promise<string> {
  return async () => {
    const failure = failures.shift();
    if (failure !== undefined) throw failure;
    return 'the trace';
  };
}

describe('a trace that only the archive has', () => {
  it('is asked for until the service has it, and told how far it is', async () => {
    const told: string[] = [];
    const waited: number[] = [];
    const wait = async (ms: number) => void waited.push(ms);
    expect(
      await fromArchive(
        request(away, away),
        (text) => told.push(text),
        () => true,
        wait,
      ),
    ).toBe('the trace');
    expect(told).toEqual([away.detail, away.detail, '']);
    expect(waited).toEqual([1000, 1000]);
  });

  it('is given up when the archive cannot give it', async () => {
    const damaged = new Problem(503, 'archive', 'is not what was sent');
    const found = fromArchive(
      request(away, damaged),
      () => {},
      () => true,
      async () => {},
    );
    await expect(found).rejects.toBe(damaged);
  });

  it('is not asked for any longer when nobody wants it', async () => {
    const asked: string[] = [];
    const found = fromArchive(
      async () => {
        asked.push('asked');
        throw away;
      },
      () => {},
      () => asked.length < 2,
      async () => {},
    );
    await expect(found).rejects.toBe(away);
    expect(asked).toEqual(['asked', 'asked']);
  });
});
