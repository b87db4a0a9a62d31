% ---- Motion between, at and on the surfaces. m.side is the sign held at each surface (of a stuck one the value that keeps
% it at zero), m.stuck says which surfaces the motion is stuck on.

function response = simulate(inputs, X, model)
    % Time, states and outputs at every sample.
    count = inputs.count;
    times = inputs.start + inputs.interval*(0:count - 1)';
    response = [times, zeros(count, numel(X))];
    [X, m] = begin_motion(times(1), X, inputs, model);
    response(1, 2:end) = X';
    base = odeset('RelTol', 1e-10, 'AbsTol', 1e-12*model.scale, 'MaxStep', inputs.interval, ...
        'InitialStep', inputs.interval/10);
    t = times(1);
    next = 2;
    changes = 0;
    while next <= count
        if times(next) - t <= 1e-9*inputs.interval
            response(next, 2:end) = X';
            next = next + 1;
            changes = 0;
            continue
        end
        % So many samples a call that a change does not throw much away; at least two, for two times would mean a span.
        last = min(count, next + 99);
        span = unique([t; (t + times(next))/2; times(next:last)]);
        options = base;
        % A motion that switches without end is followed less closely.
        if ~isempty(m.side) && changes < 64
            options = odeset(base, 'Events', @(t, X) events(t, X, m, inputs, model));
            [T, Y, te, ~, ie] = ode45(@(t, X) motion(t, X, m, inputs, model), span, X, options);
        else
            [T, Y] = ode45(@(t, X) motion(t, X, m, inputs, model), span, X, options);
            te = [];
        end
        if ~isempty(te) && te(end) > t && numel(T) > 1
            k = ie(find(te == te(end), 1));
            before = find(T < te(end) - 1e-6*inputs.interval, 1, 'last');
            [t, X] = locate(k, T(before), Y(before, :)', te(end), m, base, inputs, model);
            reached = before;
        else
            t = T(end);
            X = Y(end, :)';
            k = 0;
            reached = numel(T);
        end
        while next <= count && times(next) <= T(reached) + 1e-9*inputs.interval
            row = find(abs(T(1:reached) - times(next)) <= 1e-9*inputs.interval, 1);
            response(next, 2:end) = project(times(next), Y(row, :)', m, inputs, model)';
            next = next + 1;
            changes = 0;
        end
        if any(~isfinite(X))
            error('the response leaves the finite numbers');
        end
        X = project(t, X, m, inputs, model);
        if k > 0
            changes = changes + 1;
            [X, m] = change(k, t, X, m, inputs, model);
        else
            [X, m] = mend(t, X, m, inputs, model);
        end
    end
    if ~isempty(model.outputs), response = [response, shown(response, inputs, model)]; end
end

function values = shown(response, inputs, model)
    % What sensors show at every sample.
    values = zeros(size(response, 1), numel(model.outputs));
    for k = 1:size(response, 1)
        X = response(k, 2:end)';
        U = inputs_at(response(k, 1), inputs);
        s = sign(surfaces(response(k, 1), X, U, zeros(numel(model.slides), 1)));
        values(k, :) = outputs(response(k, 1), X, U, s)';
    end
end

function [t, X] = locate(k, from, X, t, m, options, inputs, model)
    % The instant of a change from the last state before it: the solver's own is as good as its interpolation only.
    start = X;
    step = 1e-3*inputs.interval;
    [value, X] = distance_at(k, from, start, t, m, options, inputs, model);
    other = max(t - step, from + 0.5*(t - from));
    other_value = distance_at(k, from, start, other, m, options, inputs, model);
    for iteration = 1:10
        move = value*(t - other)/(value - other_value);
        if ~isfinite(move) || abs(move) > inputs.interval, break, end
        other = t;
        other_value = value;
        t = max(t - move, from + 1e-9*inputs.interval);
        [value, X] = distance_at(k, from, start, t, m, options, inputs, model);
        if abs(move) < 1e-13*inputs.interval || value == 0, break, end
    end
end

function [value, X] = distance_at(k, from, X, t, m, options, inputs, model)
    [~, Y] = ode45(@(t, X) motion(t, X, m, inputs, model), [from, (from + t)/2, t], X, options);
    X = Y(end, :)';
    values = events(t, X, m, inputs, model);
    value = values(k);
end

function [value, terminal, direction] = events(t, X, m, inputs, model)
    % What must stay positive for each surface: how far the motion is from a change.
    [~, m] = motion(t, X, m, inputs, model);
    g = surfaces(t, X, inputs_at(t, inputs), m.side);
    value = m.side.*g;
    stuck = m.stuck ~= 0;
    value(stuck) = model.hold*(1 + 1e-12) - abs(m.side(stuck));
    % A surface that has been zero all along changes once it is not.
    idle = ~stuck & m.side == 0;
    value(idle) = 1 - 2*(g(idle) ~= 0);
    terminal = ones(size(value));
    direction = -ones(size(value));
end

function [f, m] = motion(t, X, m, inputs, model) %#ok<INUSD>
    % The rates; stuck signs take the values that keep their surfaces at zero.
    active = find(m.stuck);
    [f, slope, column, effect] = effects(t, X, active, m, inputs);
    if ~isempty(active)
        m.side(active) = pinv(effect)*(-slope);
        f = f + column*m.side(active);
    end
end

function [f, slope, column, effect] = effects(t, X, active, m, inputs)
    % Rates with some signs at zero, the slopes of their surfaces then, and what each sign adds to both.
    U = inputs_at(t, inputs);
    s = m.side;
    s(active) = 0;
    f = rates(t, X, U, s);
    base = surface_rates(t, X, U, s, f);
    slope = base(active);
    column = zeros(numel(f), numel(active));
    effect = zeros(numel(active));
    for j = 1:numel(active)
        s(active(j)) = 1;
        rate = rates(t, X, U, s);
        moved = surface_rates(t, X, U, s, rate);
        s(active(j)) = 0;
        column(:, j) = rate - f;
        effect(:, j) = moved(active) - base(active);
    end
end

function X = project(t, X, m, inputs, model) %#ok<INUSD>
    % The state moved back on to the surfaces that it is stuck on.
    active = find(m.stuck);
    if isempty(active), return, end
    [~, ~, column, effect] = effects(t, X, active, m, inputs);
    g = surfaces(t, X, inputs_at(t, inputs), m.side);
    X = X - column*(pinv(effect)*g(active));
end

function [X, m] = settle(t, X, m, changed, inputs, model)
    % Decides between passing and sticking for surfaces at zero: the signs for which each slope is zero, or points away
    % from zero where its sign is at a bound, by projected Gauss-Seidel sweeps. changed has just come there, or is 0.
    at_zero = m.stuck ~= 0;
    before = m.side;
    before(at_zero) = 0;
    if changed > 0, at_zero(changed) = true; end
    active = find(at_zero);
    if isempty(active), return, end
    s = m.side(active);
    [~, slope, ~, effect] = effects(t, X, active, m, inputs);
    for sweep = 1:200
        moved = 0;
        for i = 1:numel(active)
            rate = slope(i) + effect(i, :)*s - effect(i, i)*s(i);
            if effect(i, i) < 0
                new = -rate/effect(i, i);
                if abs(new) >= model.hold, new = min(max(new, -1), 1); end
            elseif active(i) == changed && before(changed) ~= 0
                new = -before(changed);
            else
                new = sign(rate);
            end
            moved = max(moved, abs(new - s(i)));
            s(i) = new;
        end
        if numel(active) < 2 || moved < 1e-14, break, end
    end
    m.stuck(active) = diag(effect) < 0 & abs(s) < model.hold & abs(s) ~= 1;
    m.side(active) = s;
    X = project(t, X, m, inputs, model);
end

function value = ahead(k, t, X, m, inputs, model)
    % The sign of a surface that is passed, just after.
    U = inputs_at(t, inputs);
    [f, m] = motion(t, X, m, inputs, model);
    g = surfaces(t, X, U, m.side);
    slope = surface_rates(t, X, U, m.side, f);
    value = sign(g(k) + 1e-6*inputs.interval*slope(k));
end

function [X, m] = begin_motion(t, X, inputs, model)
    m.side = zeros(numel(model.slides), 1);
    m.side = sign(surfaces(t, X, inputs_at(t, inputs), m.side));
    m.stuck = model.slides(:) ~= 0 & m.side == 0;
    [X, m] = settle(t, X, m, 0, inputs, model);
    for k = find(~m.stuck & m.side == 0)'
        m.side(k) = ahead(k, t, X, m, inputs, model);
    end
end

function [X, m] = change(k, t, X, m, inputs, model)
    if m.stuck(k)
        [~, m] = motion(t, X, m, inputs, model);
        m.stuck(k) = false;
        m.side(k) = sign(m.side(k));
    elseif model.slides(k)
        [X, m] = settle(t, X, m, k, inputs, model);
    else
        m.side(k) = ahead(k, t, X, m, inputs, model);
    end
end

function [X, m] = mend(t, X, m, inputs, model)
    % Reads signs anew where the motion is beyond a surface unseen.
    g = surfaces(t, X, inputs_at(t, inputs), m.side);
    wrong = ~m.stuck & m.side.*g < 0;
    m.side(wrong) = sign(g(wrong));
end

% ---- Inputs between their samples: the spline of degree 7 through them, one polynomial an interval.

function U = inputs_at(t, inputs)
    % Value and two derivatives of each input.
    place = (t - inputs.start)/inputs.interval;
    k = min(max(floor(place), 0), inputs.count - 2);
    U = zeros(numel(inputs.values), 3);
    for j = 1:numel(inputs.values)
        U(j, :) = polynomial(inputs.values{j}(k + 1, :), place - k)./inputs.interval.^[0, 1, 2];
        if ~isempty(inputs.rates{j})
            rate = polynomial(inputs.rates{j}(k + 1, :), place - k)./inputs.interval.^[0, 1, 2];
            U(j, 2:3) = rate(1:2);
        end
    end
end

function out = polynomial(p, s)
    powers = s.^(0:7);
    k = 1:7;
    out = [p*powers', (p(2:8).*k)*powers(1:7)', (p(3:8).*k(2:7).*k(1:6))*powers(1:6)'];
end

function p = spline7(y)
    % Recursive filter: M. Unser, A. Aldroubi, M. Eden, IEEE Trans. Signal Processing 41 (1993) 821-848.
    poles = [-0.5352804307964382, -0.12255461519232669, -0.009148694809608277];
    basis = [[1, 120, 1191, 2416, 1191, 120, 1]/5040; [-1, -56, -245, 0, 245, 56, 1]/720; ...
        [1, 24, 15, -80, 15, 24, 1]/120; [-1, -8, 19, 0, -19, 8, 1]/24];
    margin = 48;
    n = numel(y);
    outer = min(6, n);
    y = y(:)';
    before = extended(y(1:outer), margin);
    after = extended(y(n:-1:n - outer + 1), margin);
    c = [before(end:-1:1), y, after]*prod((1 - poles).*(1 - 1./poles));
    for z = poles
        held = c(1)/(1 - z);
        for i = 1:numel(c)
            held = c(i) + z*held;
            c(i) = held;
        end
        held = z/(z*z - 1)*(c(end) + z*c(end - 1));
        c(end) = held;
        for i = numel(c) - 1:-1:1
            held = z*(held - c(i));
            c(i) = held;
        end
    end
    jets = zeros(4, n);
    for order = 1:4
        for k = 1:7
            jets(order, :) = jets(order, :) + basis(order, k)*c(margin - 3 + k:margin - 4 + k + n);
        end
    end
    jets(1, :) = y;
    a = jets(:, 1:end - 1);
    b = jets(:, 2:end);
    p = [a(1, :); a(2, :); a(3, :)/2; a(4, :)/6];
    r0 = b(1, :) - sum(p, 1);
    r1 = b(2, :) - (p(2, :) + 2*p(3, :) + 3*p(4, :));
    r2 = b(3, :) - (2*p(3, :) + 6*p(4, :));
    r3 = b(4, :) - 6*p(4, :);
    p = [p; 35*r0 - 15*r1 + 2.5*r2 - r3/6; -84*r0 + 39*r1 - 7*r2 + r3/2; ...
        70*r0 - 34*r1 + 6.5*r2 - r3/2; -20*r0 + 10*r1 - 2*r2 + r3/6]';
end

function values = extended(last, margin)
    % Values beyond some last ones (the outermost first), on the polynomial through them.
    d = last;
    count = numel(d);
    for order = 1:count - 1
        for k = count:-1:order + 1
            d(k) = d(k - 1) - d(k);
        end
    end
    values = zeros(1, margin);
    for k = 1:margin
        for order = count - 1:-1:1
            d(order) = d(order) + d(order + 1);
        end
        values(k) = d(1);
    end
end

% ---- Files.

function inputs = read_inputs(file, model)
    % Times and inputs of a CSV file, columns by their header's first words.
    lines = strtrim(strsplit(fileread(file), '\n'));
    lines = lines(cellfun(@(line) ~isempty(line) && ~any(line(1) == '#%'), lines));
    count = numel(model.input_names);
    columns = [1:count + 1, zeros(1, count)];
    if ~isempty(lines) && isnan(str2double(strtok(lines{1}, [',;', char(9)])))
        header = cellfun(@first_word, strsplit(lines{1}, {',', ';', char(9)}), 'UniformOutput', false);
        wanted = [{{'t', 'time'}}, model.input_names, model.rate_names];
        for i = 1:numel(wanted)
            columns(i) = 0;
            for name = wanted{i}
                found = find(strcmp(header, name{1}), 1);
                if columns(i) == 0 && ~isempty(found), columns(i) = found; end
            end
            if columns(i) == 0 && i <= count + 1
                error('%s: the header names no column %s', file, strjoin(wanted{i}, ' or '));
            end
        end
        lines(1) = [];
    end
    if numel(lines) < 2, error('%s: fewer than two rows of numbers', file); end
    table = zeros(numel(lines), 2*count + 1);
    for k = 1:numel(lines)
        cells = strsplit(lines{k}, {',', ';', char(9)});
        if numel(cells) < max(columns), error('%s: a row has too few cells', file); end
        table(k, columns > 0) = str2double(cells(columns(columns > 0)));
    end
    if any(isnan(table(:))), error('%s: a row has a cell that is no number', file); end
    inputs.count = numel(lines);
    inputs.start = table(1, 1);
    inputs.interval = (table(end, 1) - table(1, 1))/(inputs.count - 1);
    if any(abs(table(:, 1) - inputs.start - inputs.interval*(0:inputs.count - 1)') > 0.01*inputs.interval)
        error('%s: the times are not evenly spaced, or more than one record is in the file', file);
    end
    inputs.values = cell(1, count);
    inputs.rates = cell(1, count);
    for j = 1:count
        inputs.values{j} = spline7(table(:, 1 + j));
        if columns(1 + count + j) > 0, inputs.rates{j} = spline7(table(:, 1 + count + j)); end
    end
end

function word = first_word(text)
    word = lower(regexp(strtrim(strrep(text, '"', '')), '^[A-Za-z0-9]*', 'match', 'once'));
end

function write_response(file, response, model)
    out = fopen(file, 'w');
    if out < 0, error('cannot write %s', file); end
    fprintf(out, 't%s\n', sprintf(',%s', model.states{:}, model.outputs{:}));
    fprintf(out, ['%.17g', repmat(',%.17g', 1, size(response, 2) - 1), '\n'], response');
    fclose(out);
end
