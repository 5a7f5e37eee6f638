#!/usr/bin/env python3
"""Random formulas and tables against Python: values by its own arithmetic, slopes by complex steps
(Squire & Trapp, SIAM Review 40, 1998), second derivatives by differences of those; tables against
SciPy."""

import argparse
import cmath
import math
import random
import subprocess
import sys

import numpy
from scipy.interpolate import RectBivariateSpline, RegularGridInterpolator

STEP = 1e-100


def real(x):
    return x.real


def truth(x):
    if math.isnan(real(x)):
        raise ValueError
    return real(x) != 0


def divide(a, b):
    if b == 0:
        raise ZeroDivisionError
    return a / b


def power(a, b):
    if not isinstance(a, complex) and not isinstance(b, complex):
        return math.pow(a, b)
    value = math.pow(real(a), real(b))
    change = 0.0
    if a.imag:
        change += real(b) * math.pow(real(a), real(b) - 1) * a.imag
    if b.imag:
        change += value * math.log(real(a)) * b.imag
    return complex(value, change)


def select(a, b, takes_a):
    return a if takes_a else b


def flat(f):
    return lambda x: f(real(x))


def function(name):
    def call(x):
        return getattr(cmath if isinstance(x, complex) else math, name)(x)
    return call


def arc(name):
    def call(x):
        if abs(real(x)) > 1:
            raise ValueError
        return function(name)(x)
    return call


def positive(name):
    def call(x):
        if real(x) < 0 or (real(x) == 0 and name != 'sqrt'):
            raise ValueError
        return function(name)(x)
    return call


def hypot(a, b):
    if isinstance(a, complex) or isinstance(b, complex):
        size = math.hypot(real(a), real(b))
        if size == 0:
            raise ValueError
        return complex(size, (real(a) * a.imag + real(b) * b.imag) / size)
    return math.hypot(a, b)


def atan2(a, b):
    if isinstance(a, complex) or isinstance(b, complex):
        size = math.hypot(real(a), real(b))
        if size == 0:
            raise ValueError
        return complex(math.atan2(real(a), real(b)),
                       (real(b) * a.imag - real(a) * b.imag) / size / size)
    return math.atan2(a, b)


unsound = []  # what nobody can say: multiples beyond the digits


def mod(a, b):
    if abs(real(divide(a, b))) > 1e8:
        unsound.append(a)
    return a - b * math.floor(real(divide(a, b)))


def deadband(x, w):
    return x - w if real(x) > real(w) else x + w if real(x) < -real(w) else x - x


def ascend(t0, t1):
    if real(t0) > real(t1):
        raise ValueError


def rise(shape):
    def call(t, t0, y0, t1, y1):
        ascend(t0, t1)
        if not real(t) < real(t1):
            return y1
        if not real(t0) < real(t1) or real(t) < real(t0):
            return y0
        return y0 + (y1 - y0) * shape((t - t0) / (t1 - t0))
    return call


def pulse(t, t0, t1):
    ascend(t0, t1)
    return float(real(t0) <= real(t) < real(t1))


FUNCTIONS = {
    'sin': (1, function('sin')), 'cos': (1, function('cos')), 'tan': (1, function('tan')),
    'asin': (1, arc('asin')), 'acos': (1, arc('acos')), 'atan': (1, function('atan')),
    'sinh': (1, function('sinh')), 'cosh': (1, function('cosh')), 'tanh': (1, function('tanh')),
    'exp': (1, function('exp')), 'ln': (1, positive('log')), 'log': (1, positive('log')),
    'log10': (1, positive('log10')), 'sqrt': (1, positive('sqrt')),
    'abs': (1, lambda x: select(x, -x, real(x) >= 0)),
    'sign': (1, flat(lambda x: float((x > 0) - (x < 0)))),
    'floor': (1, flat(lambda x: float(math.floor(x)))), 'ceil': (1, flat(lambda x: float(math.ceil(x)))),
    'min': (2, lambda a, b: select(a, b, real(a) < real(b))),
    'max': (2, lambda a, b: select(a, b, real(a) > real(b))),
    'mod': (2, mod), 'atan2': (2, atan2), 'hypot': (2, hypot),
    'clamp': (3, lambda x, a, b: select(a, m, real(a) > real(m))
              if (m := select(x, b, real(x) < real(b))) is not None else None),
    'deadband': (2, lambda x, w: deadband(x, w if real(w) >= 0 else -w)),
    'step': (5, rise(lambda s: s * s * s * (10 + s * (6 * s - 15)))), 'ramp': (5, rise(lambda s: s)),
    'pulse': (3, pulse),
}
WIDE = {'abs': lambda x, w: hypot(x, w), 'sign': lambda x, w: divide(x, hypot(x, w))}

# binding strength, operation
BINARY = {
    '||': 1, '&&': 2, '<': 3, '<=': 3, '>': 3, '>=': 3, '==': 3, '!=': 3,
    '+': 4, '-': 4, '*': 5, '/': 5, '^': 7,
}


class Node:
    def __init__(self, text, strength, value):
        self.text, self.strength, self.value = text, strength, value

    def within(self, least):
        """The text, in parentheses where others bind more strongly, and now and then where not."""
        if self.strength < least or random.random() < 0.05:
            return '(' + self.text + ')'
        return self.text


def leaf():
    if random.random() < 0.65:
        name = random.choice('xyz')
        return Node(name, 9, lambda at, name=name: at[name])
    number = random.choice([random.randint(0, 4), round(random.uniform(0, 3), 2), math.pi])
    text = 'pi' if number == math.pi else str(number)
    if 0 < number < 1 and random.random() < 0.3:
        text = text.lstrip('0')
    return Node(text, 9, lambda at, number=float(number): number)


def blank():
    return random.choice(['', '', ' '])


def combine(symbol, a, b):
    strength = BINARY[symbol]
    if symbol == '^':  # from the right; the base is no sign
        text = a.within(8) + '^' + b.within(6)
    elif strength == 3:  # comparisons do not follow each other
        text = a.within(4) + blank() + symbol + blank() + b.within(4)
    else:
        text = a.within(strength) + blank() + symbol + blank() + b.within(strength + 1)

    def value(at):
        if symbol == '&&':
            return float(truth(a.value(at)) and truth(b.value(at)))
        if symbol == '||':
            return float(truth(a.value(at)) or truth(b.value(at)))
        p, q = a.value(at), b.value(at)
        if symbol == '+':
            return p + q
        if symbol == '-':
            return p - q
        if symbol == '*':
            return p * q
        if symbol == '/':
            return divide(p, q)
        if symbol == '^':
            return power(p, q)
        d = real(p) - real(q)
        return float({'<': d < 0, '<=': d <= 0, '>': d > 0, '>=': d >= 0, '==': d == 0, '!=': d != 0}[symbol])
    return Node(text, strength, value)


def grow(depth):
    kind = random.random()
    if depth == 0 or kind < 0.12:
        return leaf()
    if kind < 0.55:
        symbols = ['+', '-', '*', '/'] * 6 + ['^'] * 3 + list(BINARY)
        return combine(random.choice(symbols), grow(depth - 1), grow(depth - 1))
    if kind < 0.63:
        a = grow(depth - 1)
        # A sign binds less than a power, more than a product.
        return Node('-' + blank() + a.within(6), 6, lambda at: -a.value(at))
    if kind < 0.70:
        a, b, c = (grow(depth - 1) for _ in range(3))
        value = lambda at: b.value(at) if truth(a.value(at)) else c.value(at)
        if random.random() < 0.5:
            return Node('if(%s, %s, %s)' % (a.text, b.text, c.text), 9, value)
        return Node(a.within(1) + ' ? ' + b.within(0) + ' : ' + c.within(0), 0, value)
    name = random.choice(list(FUNCTIONS))
    count, call = FUNCTIONS[name]
    if name in WIDE and random.random() < 0.5:
        count, call = 2, WIDE[name]
    arguments = [grow(depth - 1) for _ in range(count)]
    text = name + '(' + ', '.join(a.text for a in arguments) + ')'
    return Node(text, 9, lambda at: call(*[a.value(at) for a in arguments]))


def calc(node, at):
    """nan where it has no finite value."""
    try:
        value = node.value(at)
        return value if cmath.isfinite(value) else math.nan
    except (ValueError, ZeroDivisionError, OverflowError):
        return math.nan


def calc_slope(node, at, name):
    moved = dict(at)
    moved[name] = complex(at[name], STEP)
    value = complex(calc(node, moved))
    return math.nan if cmath.isnan(value) else value.imag / STEP


def calc_noise(node, at, what):
    """How far round-off of the inputs moves it."""
    here, most = what(node, at), 0.0
    for name in 'xyz':
        for factor in (1 - 1e-13, 1 + 1e-13):
            moved = dict(at)
            moved[name] *= factor
            change = abs(what(node, moved) - here)
            most = math.inf if math.isnan(change) else max(most, change)
    return most


class Tally:
    def __init__(self):
        self.compared = self.tight = self.refused = 0
        self.wrong = []

    def compare(self, what, found, expected, noise):
        if math.isnan(expected):
            return
        if math.isnan(found) and what.startswith('∂'):  # of a root of zero that stays zero, say
            self.refused += 1
            return
        self.compared += 1
        self.tight += noise <= 1e-5 * (1 + abs(expected))
        if not abs(found - expected) <= 1e-10 * (1 + abs(expected)) + 100 * noise:
            self.wrong.append('%s: %r, Python has %r (noise %g)' % (what, found, expected, noise))


def check_formulas(program, count):
    cases = []
    while len(cases) < count:
        node = grow(random.randint(1, 5))
        if len(node.text) < 400:
            cases.append((node, {name: random.uniform(-2, 2) for name in 'xyz'}))
    lines = ['formula %r %r %r %s' % (at['x'], at['y'], at['z'], node.text) for node, at in cases]
    values, slopes, seconds, undefined = Tally(), Tally(), Tally(), 0
    for (node, at), line in zip(cases, run(program, lines)):
        if any(refusal in line for refusal in ('low above its high', 'width of deadband', 'must ascend')):
            continue
        if line.startswith('!'):
            values.wrong.append(node.text + ' ' + line)
            continue
        numbers = [float(word) for word in line.split()]
        place = '%s at %r' % (node.text, at)
        unsound.clear()
        value = calc(node, at)
        if unsound:
            continue
        if math.isnan(value):
            undefined += 1
            if math.isfinite(numbers[0]):
                values.wrong.append('%s: %r, Python has no value' % (place, numbers[0]))
            continue
        for found in {numbers[0], numbers[4]}:
            values.compare(place, found, value, calc_noise(node, at, calc))
        for i, name in enumerate('xyz'):
            slope = lambda n, a, name=name: calc_slope(n, a, name)
            noise = calc_noise(node, at, slope)
            for found in {numbers[1 + i]} | ({numbers[5]} if i == 0 else set()):
                slopes.compare('∂/∂%s of %s' % (name, place), found, slope(node, at), noise)
        rates = []
        for h in (1e-4, 2e-4):
            rate = [calc_slope(node, dict(at, x=at['x'] + k * h), 'x') for k in (-1, 1)]
            rates.append((rate[1] - rate[0]) / (2 * h))
        kink = abs(calc_slope(node, dict(at, x=at['x'] + 2e-4), 'x')
                   - calc_slope(node, dict(at, x=at['x'] - 2e-4), 'x'))
        noise = abs(rates[0] - rates[1]) + 1e-9 * kink / 1e-4
        if noise < 1e-3 * (1 + abs(rates[0])) and abs(calc_slope(node, at, 'x')) < 100:
            seconds.compare('∂²/∂x² of ' + place, numbers[6], rates[0], noise + 1e-7 * (1 + abs(rates[0])))
    print('%d formulas, %d without a value' % (count, undefined))
    return {'values': values, 'slopes': slopes, 'second derivatives': seconds}


def check_tables(program):
    lines, expected = [], []
    for number in range(20):
        n, m = random.randint(4, 9), random.randint(4, 9)
        x, y = (numpy.cumsum([random.uniform(0.2, 1.5) for _ in range(k)]) for k in (n, m))
        z = numpy.array([[random.uniform(-3, 3) for _ in y] for _ in x])
        numbers = ' '.join(repr(float(v)) for v in [*x, *y, *z.flatten()])
        lines.append('table s%d spline refuse %d %d %s' % (number, n, m, numbers))
        lines.append('table l%d linear refuse %d %d %s' % (number, n, m, numbers))
        # Interpolating splines of FITPACK have no knots at the second points: not a knot.
        spline = RectBivariateSpline(x, y, z, kx=3, ky=3, s=0)
        linear = RegularGridInterpolator((x, y), z)
        for _ in range(50):
            a, b = random.uniform(x[0], x[-1]), random.uniform(y[0], y[-1])
            lines.append('formula %r %r 0 s%d(x, y)' % (a, b, number))
            expected.append([spline.ev(a, b), spline.ev(a, b, 1, 0), spline.ev(a, b, 0, 1), spline.ev(a, b, 2, 0)])
            lines.append('formula %r %r 0 l%d(x, y)' % (a, b, number))
            expected.append([float(linear((a, b))), None, None, 0.0])
            # Along a curve: the chain rule's mixed terms.
            lines.append('formula %r %r 0 s%d(x, y + 0*z + sin(x) - sin(%r))' % (a, b, number, a))
            c, s = math.cos(a), math.sin(a)
            expected.append([spline.ev(a, b), spline.ev(a, b, 1, 0) + c * spline.ev(a, b, 0, 1),
                             spline.ev(a, b, 0, 1),
                             spline.ev(a, b, 2, 0) + 2 * c * spline.ev(a, b, 1, 1)
                             + c * c * spline.ev(a, b, 0, 2) - s * spline.ev(a, b, 0, 1)])
    tally = Tally()
    answers = run(program, lines)
    for line, (value, fx, fy, fxx) in zip(answers, expected):
        numbers = [float(word) for word in line.split()]
        for what, found, wanted in (('value', numbers[0], value), ('∂/∂x', numbers[1], fx),
                                    ('∂/∂y', numbers[2], fy), ('∂²/∂x²', numbers[6], fxx)):
            if wanted is not None:
                # Splines of unevenly spread points are as large as this.
                tally.compare(what + ' of a table', found, float(wanted), 1e-12 * (1 + abs(float(wanted))) * 10)
    return {'tables': tally}


def run(program, lines):
    result = subprocess.run([program], input='\n'.join(lines) + '\n', capture_output=True, text=True, check=True)
    answers = result.stdout.splitlines()
    if len(answers) != sum(line.startswith('formula') for line in lines):
        sys.exit('the program does not answer every formula')
    return answers


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('--program', required=True)
    parser.add_argument('--count', type=int, default=10000)
    parser.add_argument('--seed', type=int, default=20)
    options = parser.parse_args()
    random.seed(options.seed)
    failed = False
    for name, tally in {**check_formulas(options.program, options.count), **check_tables(options.program)}.items():
        print('%s: %d compared, %d of them without noise, %d wrong, %d refused'
              % (name, tally.compared, tally.tight, len(tally.wrong), tally.refused))
        for line in tally.wrong[:20]:
            print('  ' + line)
        if (tally.wrong or tally.tight < 0.9 * tally.compared or tally.compared < 0.3 * options.count
                or tally.refused > 0.01 * tally.compared):
            failed = True
    sys.exit(1 if failed else 0)


main()
