"""A scatter plot with logarithmic axes as SVG, for the figures of pages."""

import html
import math

WIDTH, HEIGHT = 640, 420
LEFT, RIGHT, TOP, BOTTOM = 64, 130, 14, 46


class Axis:
    """Logarithmic, from the decade below the smallest value to the one above the largest."""

    def __init__(self, values, start, end):
        self.low = math.floor(math.log10(min(values)))
        self.high = math.ceil(math.log10(max(values)))
        self.high += self.low == self.high
        self.start, self.end = start, end

    def at(self, value):
        return self.start + (math.log10(value) - self.low) / (self.high - self.low) * (self.end - self.start)

    def decades(self):
        return range(self.low, self.high + 1)


class Plot:
    def __init__(self, x_title, y_title, x_values, y_values):
        self.x = Axis(x_values, LEFT, WIDTH - RIGHT)
        self.y = Axis(y_values, HEIGHT - BOTTOM, TOP)
        self.titles = x_title, y_title
        self.parts, self.labels = [], []

    def mark(self, x, y, color, label="", hollow=False):
        px, py = self.x.at(x), self.y.at(y)
        fill = "white" if hollow else color
        self.parts.append(f'<circle cx="{px:.1f}" cy="{py:.1f}" r="4" fill="{fill}" stroke="{color}" stroke-width="1.5"/>')
        if label:
            self.labels.append([px + 7, py + 3.5, color, label])

    def line(self, points, color, dash=""):
        path = " ".join(f"{self.x.at(x):.1f},{self.y.at(y):.1f}" for x, y in points)
        self.parts.append(f'<polyline points="{path}" fill="none" stroke="{color}" stroke-dasharray="{dash}"/>')

    def svg(self):
        # labels that would overlap move down
        self.labels.sort(key=lambda label: label[1])
        for i, label in enumerate(self.labels):
            for other in self.labels[:i]:
                if abs(label[0] - other[0]) < 90 and abs(label[1] - other[1]) < 9:
                    label[1] = other[1] + 9
        lines = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="11">',
                 f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>']
        for axis, is_x in ((self.x, True), (self.y, False)):
            for exponent in axis.decades():
                at = axis.at(10 ** exponent)
                ends = (at, TOP, at, HEIGHT - BOTTOM) if is_x else (LEFT, at, WIDTH - RIGHT, at)
                lines.append('<line x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}" stroke="#dddddd"/>'.format(*ends))
                place = (at, HEIGHT - BOTTOM + 15, "middle") if is_x else (LEFT - 6, at + 4, "end")
                lines.append('<text x="{:.1f}" y="{:.1f}" text-anchor="{}">'.format(*place) +
                             f'10<tspan dy="-4" font-size="8">{exponent}</tspan></text>')
        lines += self.parts
        lines += [f'<text x="{x:.1f}" y="{y:.1f}" fill="{color}" font-size="9">{html.escape(text)}</text>'
                  for x, y, color, text in self.labels]
        middle = (TOP + HEIGHT - BOTTOM) / 2
        lines.append(f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 10}" text-anchor="middle">{html.escape(self.titles[0])}</text>')
        lines.append(f'<text x="16" y="{middle}" text-anchor="middle" transform="rotate(-90 16 {middle})">{html.escape(self.titles[1])}</text>')
        return "\n".join(lines) + "\n</svg>\n"
