import { expect, it } from 'vitest';
import { DATA, withData, type SavedReport } from './saved';

const saved = { headline: 'a </script> $& b', made: '', names: {}, found: {} } as unknown as SavedReport;

it('no text of a report ends its element, and its program reads it back', () => {
  const file = withData(`<body>${DATA}</body>`, saved);
  expect(file.match(/<\/script>/g)).toHaveLength(1);
  const text = /json">(.*)<\/script>/.exec(file)![1]!;
  expect(JSON.parse(text)).toEqual(saved);
});

it('a page without the program says so', () => {
  expect(() => withData('<html></html>', saved)).toThrow('build it again');
});
