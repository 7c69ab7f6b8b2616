import { expect, it } from 'vitest';
import { EarlySocket } from './early_socket';
import type { Socket } from './socket';

it('says what it wants when it opens, and keeps what is said until somebody listens', () => {
  const sent: string[] = [];
  const real: Omit<Socket, 'listen'> = {
    ...{ onopen: null, onclose: null, onmessage: null },
    send: (text) => sent.push(text),
    close: () => sent.push('closed'),
  };
  const says = (data: string): void => real.onmessage?.({ data } as MessageEvent<string>);
  const heard: string[] = [];
  const early = new EarlySocket(real, 'first');
  real.onopen?.({} as Event);
  says('1');
  early.onopen = () => heard.push('open');
  early.onmessage = ({ data }) => heard.push(data);
  early.onclose = ({ reason }) => heard.push(reason);
  expect([sent, heard]).toEqual([['first'], []]);
  early.listen();
  says('2');
  real.onclose?.({ reason: 'the end' } as CloseEvent);
  expect(heard).toEqual(['open', '1', '2', 'the end']);
  early.send('more');
  early.close();
  expect(sent).toEqual(['first', 'more', 'closed']);
});
