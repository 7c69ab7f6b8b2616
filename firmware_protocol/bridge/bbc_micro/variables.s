; All variables. The bridge never returns to BASIC, so the language's zero page is free.

.include "protocol.inc"

.segment "ZEROPAGE": zeropage

.exportzp rx_in, rx_out, tx_in, tx_out, tx_on, irq_status
.exportzp crc_low, crc_high, received, too_long, reply_bytes, entry, code_at, code, count, scratch, pointer
.exportzp now, since, stored, looked, following, tick, unchanged, read_once, powered, has_looked
.exportzp session, nonce, newest, stop, fresh, seeded, boots, restarted, frozen, missed, written_tick
.exportzp ring_newest, ring_count, sampling, sample_sequence, sample_after, sample_mask, sample_begun
.exportzp product, mask, joint, ring_pointer, begun, oldest, sample_mark, frozen_tick, missed_one
.exportzp sample_opcode, taken, unsure

; the line
rx_in:          .res 1          ; next free place; the interrupt moves it
rx_out:         .res 1
tx_in:          .res 1
tx_out:         .res 1          ; next byte to be sent; the interrupt moves it
tx_on:          .res 1
irq_status:     .res 1

; frames
crc_low:        .res 1
crc_high:       .res 1
received:       .res 1          ; bytes since the last zero
too_long:       .res 1          ; they are more than any frame has
reply_bytes:    .res 1          ; of the payload
entry:          .res 1          ; of the request, in the table of requests
code_at:        .res 1
code:           .res 1
count:          .res 1
scratch:        .res 2
pointer:        .res 2

; time and the controller's period
now:            .res 2          ; microseconds, wrapping after 65 ms
since:          .res 2          ; from `stored` to `now`
stored:         .res 2          ; when the newest results began to be stored
looked:         .res 2          ; when the positions were looked at last
following:      .res 1
tick:           .res 4          ; number of the period whose results were stored last
unchanged:      .res 1          ; periods in a row in which no position changed
read_once:      .res 1
unsure:         .res 1          ; the change of the positions was not seen to happen
powered:        .res 1
has_looked:     .res 1

; the session, and what is in force
session:        .res 4
nonce:          .res 4
newest:         .res 4          ; number of the newest command
stop:           .res 4          ; number of the newest stop
fresh:          .res 4          ; the number given last
seeded:         .res 1
boots:          .res 2
restarted:      .res 1          ; FLAG_RESTARTED or 0
frozen:         .res 1          ; FLAG_FROZEN or 0
frozen_tick:    .res 4
missed:         .res 4
written_tick:   .res 4          ; the last period that had begun when set points were written

; samples
ring_newest:    .res 4
ring_count:     .res 1
sampling:       .res 1          ; a Sample waits
sample_sequence: .res 2
sample_after:   .res 4
sample_mask:    .res 1
sample_opcode:  .res 1          ; SAMPLE or MOVE_AND_SAMPLE
taken:          .res 1          ; the last period that had begun before its set points were written
sample_begun:   .res 1          ; periods that it may still wait
sample_mark:    .res 2          ; when the present one of them began
begun:          .res 4          ; the last period that has begun; a tick to be looked up
oldest:         .res 4
ring_pointer:   .res 2

product:        .res 4
mask:           .res 1
joint:          .res 1
missed_one:     .res 1

.segment "BSS"

.export body, reply, held, fresh_reading, positions, frozen_postures

body:           .res 57         ; what came between two zeros: length, sequence number, opcode, payload, CRC
reply:          .res 57         ; the same of the reply
held:           .res 42         ; the reading before: set point, position, error, power of six joints
fresh_reading:  .res 42         ; the newest reading
positions:      .res 12         ; at the last look
frozen_postures: .res 12        ; low and high bytes of what a stop has put into the set points

.segment "PAGES"

.export rx_ring, tx_ring, crc_table_low, crc_table_high, snapshots

rx_ring:        .res 256
tx_ring:        .res 256
crc_table_low:  .res 256
crc_table_high: .res 256
snapshots:      .res 64 * RING_DEPTH ; a status byte and 42 bytes, in places of 64
