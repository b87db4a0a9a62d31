/* ---- Inputs between their samples: the spline of degree 7 through them, one polynomial an interval. */

#define MARGIN 48
#define END_DEGREE 5

static int samples;
static double start, interval;
static double *values[INPUTS + 1];     /* eight coefficients an interval */
static double *value_rates[INPUTS + 1]; /* the same of a derivative that has a column of its own, or NULL */

static void fail(const char *what)
{
    fprintf(stderr, "%s\n", what);
    exit(1);
}

static void *memory(size_t count, size_t size)
{
    void *p = calloc(count, size);
    if (!p) fail("out of memory");
    return p;
}

/* Continues c beyond one end by the polynomial through the outermost values; c[at] is the first of these. */
static void extend(double *c, int at, int step, int degree)
{
    double d[END_DEGREE + 1];
    for (int k = 0; k <= degree; k++) d[k] = c[at + step * (degree - k)];
    for (int order = 1; order <= degree; order++)
        for (int k = degree; k >= order; k--) d[k] = d[k - 1] - d[k];
    for (int k = 1; k <= MARGIN; k++) {
        for (int order = degree - 1; order >= 0; order--) d[order] += d[order + 1];
        c[at + step * (degree + k)] = d[0];
    }
}

/* Recursive filter: M. Unser, A. Aldroubi, M. Eden, IEEE Trans. Signal Processing 41 (1993) 821-848. */
static double *spline(const double *y, int n)
{
    static const double pole[3] = {-0.5352804307964382, -0.12255461519232669, -0.009148694809608277};
    static const double basis[4][7] = {
        {1 / 5040.0, 120 / 5040.0, 1191 / 5040.0, 2416 / 5040.0, 1191 / 5040.0, 120 / 5040.0, 1 / 5040.0},
        {-1 / 720.0, -56 / 720.0, -245 / 720.0, 0, 245 / 720.0, 56 / 720.0, 1 / 720.0},
        {1 / 120.0, 24 / 120.0, 15 / 120.0, -80 / 120.0, 15 / 120.0, 24 / 120.0, 1 / 120.0},
        {-1 / 24.0, -8 / 24.0, 19 / 24.0, 0, -19 / 24.0, 8 / 24.0, 1 / 24.0}};
    int total = n + 2 * MARGIN, degree = n - 1 < END_DEGREE ? n - 1 : END_DEGREE;
    double *c = memory(total, sizeof *c), *jet = memory(4 * (size_t)n, sizeof *jet);
    double *out = memory(8 * (size_t)n, sizeof *out), gain = 1;
    memcpy(c + MARGIN, y, n * sizeof *c);
    extend(c, MARGIN + n - 1 - degree, 1, degree);
    extend(c, MARGIN + degree, -1, degree);
    for (int p = 0; p < 3; p++) gain *= (1 - pole[p]) * (1 - 1 / pole[p]);
    for (int i = 0; i < total; i++) c[i] *= gain;
    for (int p = 0; p < 3; p++) {
        double z = pole[p], before = c[0] / (1 - z), after;
        for (int i = 0; i < total; i++) c[i] = before = c[i] + z * before;
        c[total - 1] = after = z / (z * z - 1) * (c[total - 1] + z * c[total - 2]);
        for (int i = total - 2; i >= 0; i--) c[i] = after = z * (after - c[i]);
    }
    for (int i = 0; i < n; i++)
        for (int order = 0; order < 4; order++) {
            double sum = 0;
            for (int k = 0; k < 7; k++) sum += c[MARGIN - 3 + i + k] * basis[order][k];
            jet[4 * i + order] = order ? sum : y[i];
        }
    for (int i = 0; i + 1 < n; i++) {
        const double *a = jet + 4 * i, *b = a + 4;
        double *p = out + 8 * i, r0, r1, r2, r3;
        p[0] = a[0], p[1] = a[1], p[2] = a[2] / 2, p[3] = a[3] / 6;
        r0 = b[0] - (p[0] + p[1] + p[2] + p[3]), r1 = b[1] - (p[1] + 2 * p[2] + 3 * p[3]);
        r2 = b[2] - (2 * p[2] + 6 * p[3]), r3 = b[3] - 6 * p[3];
        p[4] = 35 * r0 - 15 * r1 + 2.5 * r2 - r3 / 6, p[5] = -84 * r0 + 39 * r1 - 7 * r2 + r3 / 2;
        p[6] = 70 * r0 - 34 * r1 + 6.5 * r2 - r3 / 2, p[7] = -20 * r0 + 10 * r1 - 2 * r2 + r3 / 6;
    }
    free(c);
    free(jet);
    return out;
}

/* Value and two derivatives of a polynomial at a place of its interval. */
static void polynomial(const double *p, double s, double *out)
{
    double value = 0, first = 0, half = 0;
    for (int k = 7; k >= 0; k--) half = half * s + first, first = first * s + value, value = value * s + p[k];
    out[0] = value, out[1] = first / interval, out[2] = 2 * half / (interval * interval);
}

static void inputs_at(double t, double U[][3])
{
    double place = (t - start) / interval;
    int k = place > 0 ? (int)place : 0;
    if (k > samples - 2) k = samples - 2;
    for (int j = 0; j < INPUTS; j++) {
        polynomial(values[j] + 8 * (size_t)k, place - k, U[j]);
        if (value_rates[j]) {
            double rate[3];
            polynomial(value_rates[j] + 8 * (size_t)k, place - k, rate);
            U[j][1] = rate[0], U[j][2] = rate[1];
        }
    }
}

/* ---- Motion between, at and on the surfaces. */

static int stuck[SURFACES + 1];
static double side[SURFACES + 1];    /* the held sign; of a stuck surface the value that keeps it at zero */
static double largest[SURFACES + 1]; /* largest magnitude so far */

#define RESOLUTION 1e-12
#define MOST_CHANGES 64

static double sign(double a) { return a > 0 ? 1 : a < 0 ? -1 : 0; }

/* Rates f with the signs of some surfaces at zero, the slopes of these surfaces then, and what each sign adds to both. */
static void effects(double t, const double *X, const int *active, int m, double *f, double *slope,
                    double column[][STATES], double effect[][SURFACES + 1])
{
    double U[INPUTS + 1][3], s[SURFACES + 1], rate[STATES], base[SURFACES + 1], moved[SURFACES + 1];
    inputs_at(t, U);
    memcpy(s, side, sizeof s);
    for (int i = 0; i < m; i++) s[active[i]] = 0;
    rates(t, X, U, s, f);
    surface_rates(t, X, U, s, f, base);
    for (int i = 0; i < m; i++) slope[i] = base[active[i]];
    for (int j = 0; j < m; j++) {
        s[active[j]] = 1;
        rates(t, X, U, s, rate);
        surface_rates(t, X, U, s, rate, moved);
        s[active[j]] = 0;
        for (int i = 0; i < STATES; i++) column[j][i] = rate[i] - f[i];
        for (int i = 0; i < m; i++) effect[i][j] = moved[active[i]] - base[active[i]];
    }
}

static int stuck_list(int *list)
{
    int m = 0;
    for (int k = 0; k < SURFACES; k++)
        if (stuck[k]) list[m++] = k;
    return m;
}

/* Solves a x = b; what a does not determine keeps its value. */
static void solve(int m, double a[][SURFACES + 1], double *b, double *x)
{
    double size[SURFACES + 1];
    int open[SURFACES + 1] = {0};
    for (int i = 0; i < m; i++) size[i] = fabs(a[i][i]);
    for (int i = 0; i < m; i++) {
        open[i] = fabs(a[i][i]) <= 1e-10 * size[i];
        for (int row = i + 1; row < m && !open[i]; row++) {
            double factor = a[row][i] / a[i][i];
            for (int j = i; j < m; j++) a[row][j] -= factor * a[i][j];
            b[row] -= factor * b[i];
        }
    }
    for (int i = m - 1; i >= 0; i--) {
        if (open[i]) continue;
        double sum = b[i];
        for (int j = i + 1; j < m; j++) sum -= a[i][j] * x[j];
        x[i] = sum / a[i][i];
    }
}

/* The rates; stuck signs take the values that keep their surfaces at zero. */
static void motion(double t, const double *X, double *f)
{
    int list[SURFACES + 1] = {0}, m = stuck_list(list);
    double b[SURFACES + 1], x[SURFACES + 1], column[SURFACES + 1][STATES], effect[SURFACES + 1][SURFACES + 1];
    effects(t, X, list, m, f, b, column, effect);
    for (int i = 0; i < m; i++) b[i] = -b[i], x[i] = side[list[i]];
    solve(m, effect, b, x);
    for (int j = 0; j < m; j++) {
        side[list[j]] = x[j];
        for (int i = 0; i < STATES; i++) f[i] += x[j] * column[j][i];
    }
}

/* Moves the state back on to the surfaces that it is stuck on. */
static void project(double t, double *X)
{
    int list[SURFACES + 1] = {0}, m = stuck_list(list);
    double U[INPUTS + 1][3], g[SURFACES + 1], f[STATES], b[SURFACES + 1], x[SURFACES + 1] = {0};
    double column[SURFACES + 1][STATES], effect[SURFACES + 1][SURFACES + 1];
    if (!m) return;
    effects(t, X, list, m, f, b, column, effect);
    inputs_at(t, U);
    surfaces(t, X, U, side, g);
    for (int i = 0; i < m; i++) b[i] = -g[list[i]];
    solve(m, effect, b, x);
    for (int j = 0; j < m; j++)
        for (int i = 0; i < STATES; i++) X[i] += x[j] * column[j][i];
}

/* Decides between passing and sticking for surfaces at zero: the signs for which each slope is zero, or points away from
   zero where its sign is at a bound, by projected Gauss-Seidel sweeps. `changed` has just come there, or is -1. */
static void settle(double t, double *X, int changed)
{
    int active[SURFACES + 1] = {0}, m = 0;
    double f[STATES], slope[SURFACES + 1], before[SURFACES + 1], s[SURFACES + 1];
    double column[SURFACES + 1][STATES], effect[SURFACES + 1][SURFACES + 1];
    for (int k = 0; k < SURFACES; k++)
        if (stuck[k] || k == changed) active[m++] = k;
    for (int i = 0; i < m; i++) {
        before[i] = stuck[active[i]] ? 0 : side[active[i]];
        s[i] = side[active[i]];
    }
    effects(t, X, active, m, f, slope, column, effect);
    for (int sweep = 0; sweep < 200; sweep++) {
        double moved = 0;
        for (int i = 0; i < m; i++) {
            double rate = slope[i], new;
            for (int j = 0; j < m; j++)
                if (j != i) rate += effect[i][j] * s[j];
            if (effect[i][i] < 0) {
                double needed = -rate / effect[i][i];
                new = fabs(needed) < hold ? needed : needed > 1 ? 1 : needed < -1 ? -1 : needed;
            } else
                new = active[i] == changed && before[i] != 0 ? -before[i] : sign(rate);
            moved = fmax(moved, fabs(new - s[i]));
            s[i] = new;
        }
        if (m < 2 || moved < 1e-14) break;
    }
    for (int i = 0; i < m; i++) {
        stuck[active[i]] = effect[i][i] < 0 && fabs(s[i]) < hold && fabs(s[i]) != 1;
        side[active[i]] = s[i];
    }
    project(t, X);
}

/* What must stay positive (the distance from a change) for each surface, and its slope. */
static void observe(double t, const double *X, const double *f, double *distance, double *slope)
{
    double U[INPUTS + 1][3], g[SURFACES + 1], rate[SURFACES + 1];
    inputs_at(t, U);
    surfaces(t, X, U, side, g);
    surface_rates(t, X, U, side, f, rate);
    for (int k = 0; k < SURFACES; k++) {
        distance[k] = stuck[k] ? hold * (1 + RESOLUTION) - fabs(side[k]) : side[k] == 0 ? g[k] : side[k] * g[k];
        slope[k] = stuck[k] ? 0 : side[k] * rate[k];
    }
}

/* The sign of a surface that is passed, just after. */
static double ahead(int k, double t, const double *X)
{
    double U[INPUTS + 1][3], g[SURFACES + 1], rate[SURFACES + 1], f[STATES];
    motion(t, X, f);
    inputs_at(t, U);
    surfaces(t, X, U, side, g);
    surface_rates(t, X, U, side, f, rate);
    return sign(g[k] + 1e-6 * interval * rate[k]);
}

static void change(int k, double t, double *X)
{
    if (stuck[k]) {
        stuck[k] = 0;
        side[k] = sign(side[k]);
    } else if (slides[k])
        settle(t, X, k);
    else
        side[k] = ahead(k, t, X);
}

static void begin(double t, double *X)
{
    double U[INPUTS + 1][3], g[SURFACES + 1];
    inputs_at(t, U);
    surfaces(t, X, U, side, g);
    for (int k = 0; k < SURFACES; k++) {
        side[k] = sign(g[k]);
        stuck[k] = g[k] == 0 && slides[k];
        largest[k] = fabs(g[k]);
    }
    settle(t, X, -1);
    for (int k = 0; k < SURFACES; k++)
        if (!stuck[k] && side[k] == 0) side[k] = ahead(k, t, X);
}

/* One step of J. R. Dormand and P. J. Prince's method of order 5; the error is a share of what is allowed. */
static double dopri(double t, const double *X, const double *k1, double h, double *next)
{
    static const double a[6][6] = {
        {1.0 / 5},
        {3.0 / 40, 9.0 / 40},
        {44.0 / 45, -56.0 / 15, 32.0 / 9},
        {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
        {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
        {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}};
    static const double c[6] = {1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1, 1};
    static const double e[7] = {71.0 / 57600, 0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525, -1.0 / 40};
    double k[7][STATES], worst = 0;
    memcpy(k[0], k1, sizeof k[0]);
    for (int stage = 0; stage < 6; stage++) {
        for (int i = 0; i < STATES; i++) {
            double sum = 0;
            for (int j = 0; j <= stage; j++) sum += a[stage][j] * k[j][i];
            next[i] = X[i] + h * sum;
        }
        motion(t + c[stage] * h, next, k[stage + 1]);
    }
    for (int i = 0; i < STATES; i++) {
        double sum = 0;
        for (int j = 0; j < 7; j++) sum += e[j] * k[j][i];
        sum = fabs(h * sum) / (1e-11 * fmax(scale[i], fabs(next[i])));
        if (!(sum <= worst)) worst = sum;
    }
    return worst;
}

/* A surface's distance from its change after a part of a step. */
static double distance_at(int k, double t, const double *X, const double *k1, double h)
{
    double next[STATES], f[STATES], distance[SURFACES + 1], slope[SURFACES + 1];
    dopri(t, X, k1, h, next);
    motion(t + h, next, f);
    observe(t + h, next, f, distance, slope);
    return distance[k];
}

/* The share of a step at which surface k changes, by regula falsi (Illinois). */
static double locate(int k, double t, const double *X, const double *k1, double h, double at_start, double slope, double at_end)
{
    double low = 0, high = 1, f_low = at_start, f_high = at_end;
    double enough = stuck[k] ? 0.5 * RESOLUTION : 1e-15 * largest[k];
    int kept = 0;
    if (at_start <= 0) {
        if (slope <= 0) return 0;
        for (int i = 0; i < 30 && low == 0; i++) {
            double middle = 0.5 * high, f = distance_at(k, t, X, k1, middle * h);
            if (f > 0) low = middle, f_low = f;
            else high = middle, f_high = f;
        }
        if (low == 0) return 0;
    }
    for (int i = 0; i < 100 && high - low > 1e-14; i++) {
        double next = low + (high - low) * f_low / (f_low - f_high), f;
        if (!(next > low && next < high)) next = 0.5 * (low + high);
        f = distance_at(k, t, X, k1, next * h);
        if (fabs(f) <= enough) return next;
        if (f > 0) {
            low = next, f_low = f;
            if (kept == 1) f_high *= 0.5;
            kept = 1;
        } else {
            high = next, f_high = f;
            if (kept == -1) f_low *= 0.5;
            kept = -1;
        }
    }
    return high;
}

/* Where a surface dips below zero and comes back within a step, by the cubic through values and slopes; 0 if it does not. */
static double dip(double y0, double d0, double y1, double d1)
{
    double lowest = 0, where = 0;
    if (!(d0 < 0 && d1 > 0)) return 0;
    for (int i = 1; i < 32; i++) {
        double s = i / 32.0, r = 1 - s;
        double y = r * r * ((1 + 2 * s) * y0 + s * d0) + s * s * ((1 + 2 * r) * y1 - r * d1);
        if (y < lowest) lowest = y, where = s;
    }
    return where;
}

/* Moves the state from one sample to the next; 0 if it left the finite numbers. */
static int advance(double from, double to, double *X)
{
    static double wanted;
    double t = from, shortest = 1e-9 * interval;
    int changes = 0;
    if (wanted == 0) wanted = interval;
    double h = wanted;
    while (t < to) {
        double k1[STATES], next[STATES], f[STATES], error, part = 1;
        double d0[SURFACES + 1], v0[SURFACES + 1], d1[SURFACES + 1], v1[SURFACES + 1];
        int first = -1, again = 0, last = t + h >= to - shortest;
        if (last) h = to - t;
        motion(t, X, k1);
        observe(t, X, k1, d0, v0);
        error = dopri(t, X, k1, h, next);
        if (!(error <= 1) && h > shortest) {
            wanted = h *= error > 1 ? fmax(0.2, 0.9 * pow(error, -0.2)) : 0.2;
            continue;
        }
        motion(t + h, next, f);
        observe(t + h, next, f, d1, v1);
        for (int k = 0; k < SURFACES && changes < MOST_CHANGES; k++) {
            if (!stuck[k] && side[k] == 0) {
                if (d1[k] != 0) {
                    side[k] = sign(d1[k]);
                    again = 1;
                }
            } else if (d1[k] < (stuck[k] ? 0 : -RESOLUTION * largest[k])) {
                double at = locate(k, t, X, k1, h, d0[k], v0[k], d1[k]);
                if (first < 0 || at < part) first = k, part = at;
            } else if (!stuck[k] && h > 1e-6 * interval && first < 0) {
                double at = dip(d0[k], h * v0[k], d1[k], h * v1[k]);
                if (at > 0) {
                    h *= at;
                    again = 1;
                    break;
                }
            }
        }
        if (again) {
            changes++;
            continue;
        }
        if (first >= 0) {
            if (part > 0) {
                dopri(t, X, k1, part * h, next);
                memcpy(X, next, sizeof next);
                t += part * h;
                if (last && part == 1) t = to;
                project(t, X);
            }
            change(first, t, X);
            changes++;
        } else {
            memcpy(X, next, sizeof next);
            t = last ? to : t + h;
            project(t, X);
            if (error < 0.5) wanted = fmin(interval, h > wanted ? h : wanted) * fmin(5, 0.9 * pow(error + 1e-10, -0.2));
            if (wanted > interval) wanted = interval;
            for (int k = 0; k < SURFACES; k++)
                if (!stuck[k]) largest[k] = fmax(largest[k], fabs(d1[k]));
        }
        h = wanted;
    }
    /* A motion that switches without end is followed less closely: its signs are read where it is. */
    if (changes >= MOST_CHANGES) {
        double U[INPUTS + 1][3], g[SURFACES + 1];
        inputs_at(to, U);
        surfaces(to, X, U, side, g);
        for (int k = 0; k < SURFACES; k++)
            if (!stuck[k] && g[k] != 0) side[k] = sign(g[k]);
    }
    for (int i = 0; i < STATES; i++)
        if (!isfinite(X[i])) return 0;
    return 1;
}

/* ---- Files. */

/* The next cell's first word in lower case; 0 at the end of the line. */
static int word(char **line, char *out, size_t size)
{
    char *p = *line;
    size_t n = 0;
    if (!p) return 0;
    while (isspace((unsigned char)*p) || *p == '"') p++;
    while (isalnum((unsigned char)*p)) {
        if (n + 1 < size) out[n++] = (char)tolower((unsigned char)*p);
        p++;
    }
    out[n] = 0;
    p += strcspn(p, ",;\t\n");
    *line = *p && *p != '\n' ? p + 1 : NULL;
    return 1;
}

static int column_of(char *header, const char *const *names, int count)
{
    for (int i = 0; i < count && names[i]; i++) {
        char *line = header, name[64];
        for (int column = 0; word(&line, name, sizeof name); column++)
            if (!strcmp(name, names[i])) return column;
    }
    return -1;
}

static void read_inputs(const char *path)
{
    static char line[1 << 16];
    static const char *const time_names[] = {"t", "time"};
    int column[2 * INPUTS + 1], wanted = 2 * INPUTS + 1, room = 0;
    double *table[2 * INPUTS + 1] = {0}, *y;
    FILE *file = fopen(path, "r");
    if (!file) {
        fprintf(stderr, "cannot open %s\n", path);
        exit(1);
    }
    for (int i = 0; i < wanted; i++) column[i] = i <= INPUTS ? i : -1;
    while (fgets(line, sizeof line, file)) {
        char *p = line + strspn(line, " \t\r\n"), *end;
        if (!*p || *p == '#' || *p == '%') continue;
        strtod(p, &end);
        if (end == p) {
            column[0] = column_of(p, time_names, 2);
            for (int j = 0; j < INPUTS; j++) {
                column[1 + j] = column_of(p, input_names[j], 8);
                column[1 + INPUTS + j] = column_of(p, rate_names[j], 8);
            }
            for (int i = 0; i <= INPUTS; i++)
                if (column[i] < 0) fail(i ? "the header names no column for an input of the model" : "the header names no time");
            continue;
        }
        if (samples == room) {
            room = room ? 2 * room : 1024;
            for (int i = 0; i < wanted; i++)
                if (!(table[i] = realloc(table[i], room * sizeof *table[i]))) fail("out of memory");
        }
        for (int at = 0; p; at++) {
            double value = strtod(p, &end);
            for (int i = 0; i < wanted; i++)
                if (column[i] == at) {
                    if (end == p) fail("a row has a cell that is no number");
                    table[i][samples] = value;
                }
            p = strpbrk(p, ",;\t\n");
            p = p && *p != '\n' ? p + 1 : NULL;
            for (int i = 0; !p && i < wanted; i++)
                if (column[i] > at) fail("a row has too few cells");
        }
        samples++;
    }
    fclose(file);
    if (samples < 2) fail("the file holds fewer than two rows of numbers");
    start = table[0][0], interval = (table[0][samples - 1] - start) / (samples - 1);
    for (int k = 0; k < samples; k++)
        if (!(fabs(table[0][k] - start - k * interval) <= 0.01 * interval))
            fail("the times are not evenly spaced, or more than one record is in the file");
    for (int j = 0; j < INPUTS; j++) {
        values[j] = spline(table[1 + j], samples);
        y = column[1 + INPUTS + j] < 0 ? NULL : table[1 + INPUTS + j];
        value_rates[j] = y ? spline(y, samples) : NULL;
    }
}

static void write_row(FILE *out, double t, const double *X)
{
    double U[INPUTS + 1][3], f[STATES], y[OUTPUTS + 1];
    fprintf(out, "%.17g", t);
    for (int i = 0; i < STATES; i++) fprintf(out, ",%.17g", X[i]);
    if (OUTPUTS) {
        /* The signs of what sticks are those of the rates. */
        motion(t, X, f);
        inputs_at(t, U);
        outputs(t, X, U, side, y);
        for (int i = 0; i < OUTPUTS; i++) fprintf(out, ",%.17g", y[i]);
    }
    fputc('\n', out);
}

int main(int argc, char **argv)
{
    double X[STATES];
    FILE *out = stdout;
    int k;
    if (argc < 2 || (argc > 3 && argc != 3 + STATES)) fail("usage: PROGRAM INPUT.csv [RESPONSE.csv [INITIAL STATE]]");
    read_inputs(argv[1]);
    if (argc > 2 && !(out = fopen(argv[2], "w"))) fail("cannot write the response");
    for (int i = 0; i < STATES; i++) X[i] = argc > 3 ? atof(argv[3 + i]) : initial[i];
    fputc('t', out);
    for (int i = 0; i < STATES; i++) fprintf(out, ",%s", state_name[i]);
    for (int i = 0; i < OUTPUTS; i++) fprintf(out, ",%s", output_name[i]);
    fputc('\n', out);
    begin(start, X);
    write_row(out, start, X);
    for (k = 1; k < samples; k++) {
        if (!advance(start + (k - 1) * interval, start + k * interval, X)) fail("the response leaves the finite numbers");
        write_row(out, start + k * interval, X);
    }
    return out != stdout && fclose(out) ? (fprintf(stderr, "cannot write the response\n"), 1) : 0;
}
