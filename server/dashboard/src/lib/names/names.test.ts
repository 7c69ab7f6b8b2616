import { describe, expect, it } from 'vitest';
import { Names } from './names.svelte';

const settled = (): Promise<void> => new Promise((done) => setTimeout(done));

describe('names of what is known by its number', () => {
  it('are asked for once, and are the number until then', async () => {
    const asked: string[] = [];
    const names = new Names((id) => {
      asked.push(id);
      return Promise.resolve(`the ${id}`);
    });
    names.learn(['a', 'b', 'a']);
    expect(names.of('a')).toBe('a');
    await settled();
    names.learn(['a']);
    expect([names.of('a'), names.of('b'), names.of('c')]).toEqual(['the a', 'the b', 'c']);
    expect(asked).toEqual(['a', 'b']);
  });

  it('are asked for again where the service did not tell', async () => {
    let tries = 0;
    const names = new Names((id) =>
      ++tries > 1 ? Promise.resolve(`the ${id}`) : Promise.reject(new Error('gone')),
    );
    names.learn(['a']);
    await settled();
    expect(names.of('a')).toBe('a');
    names.learn(['a']);
    await settled();
    expect(names.of('a')).toBe('the a');
  });
});
