import { describe, expect, it } from 'vitest';
import { Problem } from '../api/problem';
import type { CatalogueEntry } from '../api/types';
import { TraceSearch } from './search.svelte';

const entries = (...ids: string[]): CatalogueEntry[] => ids.map((id) => ({ id }) as CatalogueEntry);

/** A search whose answers come when the test says so. */
function slow() {
  const answers = new Map<
    string,
    { tell: (found: CatalogueEntry[]) => void; refuse: (why: Problem) => void }
  >();
  const search = new TraceSearch(
    (query) =>
      new Promise((tell, refuse) => answers.set(query, { tell, refuse: refuse as (why: Problem) => void })),
  );
  const typed = (query: string): Promise<void> => {
    search.query = query;
    return search.load();
  };
  return { answers, search, typed };
}

describe('a search for traces', () => {
  it('shows what was found for what is typed now, whichever answer comes last', async () => {
    const { answers, search, typed } = slow();
    const first = typed('r');
    const second = typed('ramp ');
    answers.get('ramp')!.tell(entries('a'));
    await second;
    answers.get('r')!.tell(entries('a', 'b', 'c'));
    await first;
    expect(search.found?.map((one) => one.id)).toEqual(['a']);
  });

  it('does not tell of a search that is of no use any more that it failed', async () => {
    const { answers, search, typed } = slow();
    const first = typed('r');
    const second = typed('ra');
    answers.get('ra')!.tell([]);
    await second;
    answers.get('r')!.refuse(new Problem(500, 'fault', 'the reason'));
    await first;
    expect([search.found, search.problem]).toEqual([[], null]);
  });

  it('keeps what was found while it cannot be searched', async () => {
    const { answers, search, typed } = slow();
    const first = typed('');
    answers.get('')!.tell(entries('a'));
    await first;
    const second = typed('x');
    answers.get('x')!.refuse(new Problem(0, 'no-answer', 'it does not answer'));
    await second;
    expect([search.found?.length, search.problem?.detail]).toEqual([1, 'it does not answer']);
  });
});
