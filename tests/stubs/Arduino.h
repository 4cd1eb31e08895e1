// What a sketch asks of a board, as far as ours does: the tests write the readings and read what is printed.
#pragma once
#include <stdio.h>

static const int A0 = 0, A1 = 1;
static float stub_counts[2];
static unsigned long stub_micros;
static double stub_printed = -1;
static int stub_prints;

static inline int analogRead(int pin) { return (int)stub_counts[pin]; }
static inline unsigned long micros() { return stub_micros; }

struct StubSerial {
    void begin(long) {}
    void print(const char *) {}
    void println(double number, int) { stub_printed = number; ++stub_prints; }
};
static StubSerial Serial;
