import { beforeEach, describe, expect, it } from 'vitest';
import { AT_ONCE, Listing, PART, type Page } from './listing';

let there: number[];
let asked: [number, string | null][];
let listing: Listing<number>;

/** The newest first, as the service gives them: a cursor is the entry before which it goes on. */
function ask(limit: number, cursor: string | null): Promise<Page<number>> {
  asked.push([limit, cursor]);
  const rest = there.filter((one) => cursor === null || one < Number(cursor));
  const items = rest.slice(0, limit);
  return Promise.resolve({ items, next: rest.length > limit ? String(items.at(-1)) : null });
}

const numbers = (newest: number): number[] => Array.from({ length: newest }, (_, index) => newest - index);

beforeEach(() => {
  there = numbers(500);
  asked = [];
  listing = new Listing();
});

describe('a list in parts', () => {
  it('begins with one part', async () => {
    const { items, next } = await listing.load(ask);
    expect(items).toEqual(numbers(500).slice(0, PART));
    expect(next).toBe('461');
  });

  it('keeps what “more” has loaded when something new comes', async () => {
    listing.more((await listing.load(ask)).items.length);
    expect((await listing.load(ask)).items).toHaveLength(2 * PART);
    there = numbers(501);
    const { items } = await listing.load(ask);
    expect(items).toEqual(numbers(501).slice(0, 2 * PART));
  });

  it('does not show what is gone', async () => {
    listing.more(PART);
    there = there.filter((one) => one !== 450);
    const { items } = await listing.load(ask);
    expect(items).toHaveLength(2 * PART);
    expect(items).not.toContain(450);
  });

  it('asks for no more at once than the service gives', async () => {
    listing.more(AT_ONCE);
    const { items } = await listing.load(ask);
    expect(items).toEqual(numbers(500).slice(0, AT_ONCE + PART));
    expect(asked).toEqual([
      [AT_ONCE, null],
      [PART, '301'],
    ]);
  });

  it('ends where there is no more', async () => {
    there = numbers(50);
    listing.more(PART);
    expect(await listing.load(ask)).toEqual({ items: numbers(50), next: null });
    expect(asked).toHaveLength(1);
  });

  it('begins anew for another search', async () => {
    listing.more(PART);
    listing.beginAnew();
    expect((await listing.load(ask)).items).toHaveLength(PART);
  });
});
