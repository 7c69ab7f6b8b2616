; Following the controller by watching its memory: no wire tells when a period ends.
;
; Once a period the controller stores what it measured, and converters are noisy: some bit of six positions changes
; nearly every time. The first change that is seen gives the phase. From then on the bridge looks around the moment at
; which the next results are due, and counts periods by its own clock where nothing changes.

.include "protocol.inc"
.include "machine.inc"
.include "memory_map.inc"
.include "long.inc"
.importzp now, since, stored, looked, following, tick, unchanged, read_once, powered, has_looked, ring_count
.importzp boots, restarted, begun, sample_after, written_tick, scratch, unsure, product
.import positions, fresh_reading, held, read_all, same_reading, end_session, keep_snapshot

.export period_work, read_now, find_begun, wait_until_clear, begin_2_ms, end_2_ms

SEARCHING = 0                   ; the phase is unknown
EXPECTING = 1                   ; the next results are due a period after the last
SETTLING = 2                    ; results are being stored, or are read

; Microseconds. Assumed: from the beginning of a period, when the controller fetches its set points, to its storing the
; results, 6 ms; it needs less than 2 ms to store them. With another delay a set point's tick may be one off.
STORED_AFTER = 6000
BEGINS = PERIOD_US - STORED_AFTER
CLEAR_FROM = BEGINS - 600       ; around the fetch the memory is left alone
CLEAR_TO = BEGINS + 500
STORING = 2000
JUST_NOW = 1500                 ; a change was seen to happen if the look before it was no longer ago
GIVE_UP = 8000                  ; a snapshot that is not whole by then is missing
SEARCH_EVERY = 1000
EXPECT_EVERY = 200
EXPECT_FROM = PERIOD_US - 500
EXPECT_TO = PERIOD_US + 1000
MOST_UNCHANGED = 25

; Branches where the 16 bits of `value` are at least `limit`.
.macro branch_if_least value, limit, target
        lda value
        cmp #<(limit)
        lda value+1
        sbc #>(limit)
        bcs target
.endmacro

.code

; The time by timer 1, which counts down; its low byte wraps between two readings now and then.
read_now:
        lda USER_VIA_T1_HIGH
        ldx USER_VIA_T1_LOW
        cmp USER_VIA_T1_HIGH
        bne read_now
        eor #$FF
        sta now+1
        txa
        eor #$FF
        sta now
        sec
        sbc stored
        sta since
        lda now+1
        sbc stored+1
        sta since+1
        rts

period_work:
        jsr read_now
        lda following
        beq search
        cmp #EXPECTING
        beq expect
        jmp settle

search:
        test_long tick
        beq unfollowed
        branch_if_least since, PERIOD_US, another ; once followed, ticks go on by the bridge's own clock
        jmp unfollowed
another:
        jsr add_period
        increment_long tick
unfollowed:
        jsr since_look
        branch_if_least scratch, SEARCH_EVERY, search_now
        rts
search_now:
        lda #0
        sta unsure
        jsr look
        bcs seen
        rts
seen:   lda #0
        sta unchanged
        lda now
        sta stored
        lda now+1
        sta stored+1
        jmp begin_settling

expect:
        branch_if_least since, EXPECT_FROM, due
        rts
due:    jsr since_look
        branch_if_least scratch, EXPECT_EVERY, expect_now
        rts
expect_now:
        ldx #0
        stx unsure
        branch_if_least scratch, JUST_NOW, long_ago
        bcc look_again
long_ago:
        inc unsure
look_again:
        jsr look
        bcs changed
        lda following
        beq not_yet             ; the board has lost its supply
        branch_if_least since, EXPECT_TO, overdue
not_yet:
        rts
overdue:
        inc unchanged
        lda unchanged
        cmp #MOST_UNCHANGED+1
        bcs stopped
        lda #1
        sta unsure
        jsr add_period
        jmp begin_settling
stopped:
        lda #SEARCHING          ; the controller has stopped, or it is not the expected one
        sta following
        sta ring_count
        rts

; Results that come early move the expected moment there; those that are late move it by an eighth of the delay, since
; most are only seen late.
changed:
        branch_if_least since, PERIOD_US, late
        jmp seen
late:   lda since
        sec
        sbc #<PERIOD_US
        sta scratch
        lda since+1
        sbc #>PERIOD_US
        sta scratch+1
        ldx #3
halve:  lsr scratch+1
        ror scratch
        dex
        bne halve
        jsr add_period
        lda stored
        clc
        adc scratch
        sta stored
        lda stored+1
        adc scratch+1
        sta stored+1
        lda #0
        sta unchanged

begin_settling:
        increment_long tick
        lda #SETTLING
        sta following
        lda #0
        sta read_once
        rts

settle:
        branch_if_least since, STORING, stored_now
        rts
; Where the change was not seen to happen, results may be stored at any moment: the second reading then begins when any
; change that the first has met is complete.
stored_now:
        lda read_once
        beq read_whole
        lda unsure
        beq read_whole
        jsr since_look
        branch_if_least scratch, STORING, read_whole
        rts
read_whole:
        jsr read_all
        lda read_once
        beq first
        jsr same_reading
        beq whole
first:  inc read_once
        lda now
        sta looked
        lda now+1
        sta looked+1
        ldx #41
copy:   lda fresh_reading,x
        sta held,x
        dex
        bpl copy
        branch_if_least since, GIVE_UP, give_up
        rts
whole:  jsr leave_settling
        lda powered
        beq no_snapshot
        test_long tick
        beq no_snapshot
        jmp keep_snapshot
give_up:
        jsr leave_settling
no_snapshot:
        rts

; What the next results are compared with, and whether the board has its supply.
leave_settling:
        lda #EXPECTING
        sta following
        jmp look

add_period:
        lda stored
        clc
        adc #<PERIOD_US
        sta stored
        lda stored+1
        adc #>PERIOD_US
        sta stored+1
        rts

since_look:
        lda now
        sec
        sbc looked
        sta scratch
        lda now+1
        sbc looked+1
        sta scratch+1
        rts

; Reads the positions. Carry: they differ from those of the last look, and the board has its supply.
look:   lda now
        sta looked
        lda now+1
        sta looked+1
        lda #0
        sta scratch             ; whether any byte is not 0
        sta scratch+1           ; whether any byte has changed
        ldx #JOINTS-1
position:
        lda POSITION_LOW,x
        cmp positions,x
        beq same_low
        sta positions,x
        inc scratch+1
same_low:
        ora scratch
        sta scratch
        lda POSITION_HIGH,x
        cmp positions+JOINTS,x
        beq same_high
        sta positions+JOINTS,x
        inc scratch+1
same_high:
        ora scratch
        sta scratch
        dex
        bpl position
        lda scratch
        beq unpowered
        lda powered
        beq new_life
        lda has_looked
        beq first_look
        lda scratch+1
        cmp #1
        rts
first_look:
        inc has_looked
        clc
        rts

unpowered:
        lda powered
        beq still_unpowered
        jsr end_session
        jsr forget_period
        lda #0
        sta powered
still_unpowered:
        clc
        rts

; The board has been reset: no session outlives that, a freeze does.
new_life:
        inc powered
        inc boots
        bne counted
        inc boots+1
counted:
        lda #FLAG_RESTARTED
        sta restarted
        jsr end_session
        jsr forget_period
        clc
        rts

forget_period:
        lda #SEARCHING
        sta following
        sta ring_count
        sta unchanged
        clear_long tick
        clear_long written_tick
        clear_long sample_after
        rts

; Puts the last period that has begun into `begun`.
find_begun:
        jsr read_now
        copy_long tick, begun
        lda following
        beq found
        branch_if_least since, BEGINS, next_has
found:  rts
next_has:
        increment_long begun
        rts

; Waits while the controller may be about to fetch its set points: 1.1 ms at most.
wait_until_clear:
        lda following
        beq clear
near:   jsr read_now
        branch_if_least since, CLEAR_TO, clear
        branch_if_least since, CLEAR_FROM, near
clear:  rts

; The 2 ms begin; in `product`: when they end.
begin_2_ms:
        jsr read_now
        lda now
        clc
        adc #<STORING
        sta product
        lda now+1
        adc #>STORING
        sta product+1
        rts

; Waits until they have ended.
end_2_ms:
        jsr read_now
        lda now
        sec
        sbc product
        lda now+1
        sbc product+1
        bmi end_2_ms
        rts
