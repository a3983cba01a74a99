"""Which shapes touch, as SAPIEN's collision groups: four words of 32 bits a shape.

Shapes a and b touch where the upper halves of their fourth words agree and a bit is in the first word of one and the second
word of the other, unless a bit is in the third words of both (and the lower halves of the fourth words agree, which are 0 here).
So bits of the first two words are products of two sets of shapes that touch, bits of the third are sets of shapes of which no
two do, and the fourth tells groups of shapes apart that have nothing to do with each other. PhysX leaves some pairs out by
itself: those may come out either way."""

import functools

WORDS = 32
MOST_PARTS = 0xFFFF


def bits_of(mask):
    while mask:
        low = mask & -mask
        yield low.bit_length() - 1
        mask ^= low


def _products(count, touch, may):
    """Sets (first, second) whose products cover `touch` and lie within `may`; masks by shape. None: more than 32."""
    left, found = list(touch), []
    while any(left):
        best, most = None, -1
        for i in range(count):
            if not left[i]:
                continue
            for wanted in (may[i], left[i] | 1 << i if may[i] >> i & 1 else left[i]):
                second = wanted & may[i]
                first = 0
                for j in range(count):
                    if second & ~may[j] == 0:
                        first |= 1 << j
                covers = sum((left[j] & second).bit_count() for j in bits_of(first))
                if covers > most:
                    best, most = (first, second), covers
        first, second = best
        for j in bits_of(first):
            left[j] &= ~second
        for j in bits_of(second):
            left[j] &= ~first
        found.append(best)
        if len(found) > WORDS:
            return None
    return found


def _apart(count, never, may_not):
    """Sets of shapes of which no two touch, that cover `never`, each within `may_not`: the larger ones first."""
    alone = sum(1 << i for i in range(count) if may_not[i] >> i & 1)  # kinds whose own shapes need not touch each other
    left, found = [mask & alone if alone >> i & 1 else 0 for i, mask in enumerate(never)], []
    while any(left):
        best, most = 0, -1
        for i in range(count):
            if not left[i]:
                continue
            group, common = 1 << i, may_not[i] & alone
            for j in sorted(bits_of(common & ~(1 << i)), key=lambda j: -(left[j] & common).bit_count()):
                if common >> j & 1:
                    group |= 1 << j
                    common &= may_not[j] | 1 << j
            covers = sum((left[j] & group).bit_count() for j in bits_of(group))
            if covers > most:
                best, most = group, covers
        for j in bits_of(best):
            left[j] &= ~best
        found.append(best)
        if len(found) > 4 * WORDS:
            break
    return found


def _merged(count, touch, may):
    """Shapes that touch the same others, and each other, not each other, or either way, stand for each other: (number of kinds,
    kind of each shape)."""
    def keys(i):
        own = 1 << i
        return (touch[i], may[i] & ~own), (touch[i] | own, may[i] | own), (touch[i], may[i] | own)

    seen = {}
    for i in range(count):
        for key in keys(i):
            seen[key] = seen.get(key, 0) + 1
    kinds = {}
    kind_of = [kinds.setdefault(max(keys(i), key=seen.get), len(kinds)) for i in range(count)]
    return len(kinds), kind_of


def groups(count, touch, ignored):
    """The four words of each shape, or None where 32 bits do not suffice. `touch` and `ignored` are masks of other shapes by
    shape, symmetric: those that touch it, and those that PhysX leaves out by itself."""
    words, part = [None] * count, 0
    for i in range(count):
        if words[i] is not None:
            continue
        members = _connected(i, touch)
        at = {shape: k for k, shape in enumerate(members)}

        @functools.cache  # all shapes of a body have one mask of ignored ones
        def renumbered(mask):
            return mask if len(members) == count else sum(1 << at[j] for j in bits_of(mask) if j in at)

        def within(masks):
            return [renumbered(masks[shape]) for shape in members]

        found = _part(len(members), within(touch), within(ignored))
        if found is None or part > MOST_PARTS:
            return None
        for shape, own in zip(members, found):
            words[shape] = [*own[:3], part << 16]
        part += 1
    return words


def _connected(shape, touch):
    found = waiting = 1 << shape
    while waiting:
        waiting = _union(touch, waiting) & ~found
        found |= waiting
    return list(bits_of(found))


def _union(masks, of):
    union = 0
    for i in bits_of(of):
        union |= masks[i]
    return union


def _part(count, touch, ignored):
    everything = everything_of(count)
    ignored = [mask | 1 << i for i, mask in enumerate(ignored)]
    touch = [mask & ~skip for mask, skip in zip(touch, ignored)]
    never = [everything & ~(mask | skip) for mask, skip in zip(touch, ignored)]
    may = [everything & ~mask for mask in never]
    kinds, kind_of = _merged(count, touch, may)
    if kinds == count:
        return _groups(count, touch, never, ignored)
    first = {kind: i for i, kind in reversed(list(enumerate(kind_of)))}
    shapes = [first[kind] for kind in range(kinds)]

    def on_kinds(masks):
        return [sum({1 << kind_of[j] for j in bits_of(masks[i])}) for i in shapes]

    touch_kinds, never_kinds = on_kinds(touch), on_kinds(never)
    skipped = [everything_of(kinds) & ~(a | b) for a, b in zip(touch_kinds, never_kinds)]
    found = _groups(kinds, touch_kinds, never_kinds, skipped)
    return None if found is None else [found[kind] for kind in kind_of]


def everything_of(count):
    return (1 << count) - 1


def _groups(count, touch, never, ignored):
    may = [everything_of(count) & ~mask for mask in never]
    apart, excluded = [], []
    found = _products(count, touch, may)
    if found is None:
        apart = _apart(count, never, [mask | skip for mask, skip in zip(never, ignored)])
        for number in sorted({min(len(apart), 1 << power) for power in range(6)} - {0}):
            excluded, relaxed = apart[:number], list(may)
            for group in excluded:
                for i in bits_of(group):
                    relaxed[i] |= group
            found = _products(count, touch, relaxed)
            if found is not None:
                break
        if found is None:
            return None
    words = [[0, 0, 0, 0] for _ in range(count)]
    for bit, (first, second) in enumerate(found):
        for i in bits_of(first):
            words[i][0] |= 1 << bit
        for i in bits_of(second):
            words[i][1] |= 1 << bit
    for bit, group in enumerate(excluded):
        for i in bits_of(group):
            words[i][2] |= 1 << bit
    return words


def touches(a, b):
    """SAPIEN's rule."""
    return bool(a[3] >> 16 == b[3] >> 16 and (a[0] & b[1] or b[0] & a[1]) and
                not (a[2] & b[2] and a[3] & 0xFFFF == b[3] & 0xFFFF))
