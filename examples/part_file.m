% Reads a part file of simflex in MATLAB: mass, free-free frequencies, and how the part deforms under
% forces on its interfaces. The layout of the file is described in plugin/part/ReducedBodyFile.h;
% examples/part_file.py does the same in Python.
%
%   loads = struct('name', {'big_end', 'small_end'}, 'load', {[-1000 0 0 0 0 0]', [1000 0 0 0 0 0]'});
%   [part, xi] = part_file('rod.h5', loads);
%   plot3(part.positions(1, :), part.positions(2, :), part.positions(3, :), '.')
%
% A load is a force [N] and a moment [N m] on the master point of the interface along the deck's axes.
% What the loads do not balance accelerates the part (inertia relief).
function [part, xi] = part_file(path, loads)
    textOf = @(object, name) strtok(char(h5readatt(path, object, name)), char(0));
    if ~strcmp(textOf('/', 'format'), 'simflex reduced body')
        error('%s is no part file of simflex', path);
    end
    part.name = textOf('/', 'name');
    part.mass = h5read(path, '/mass');
    part.centerOfMass = h5read(path, '/center_of_mass');
    part.omegaSquared = h5read(path, '/omega_squared');
    part.frequencies = sqrt(part.omegaSquared) / (2 * pi);
    part.Phi = h5read(path, '/Phi');                     % (3 nodes) x modes, as in the formulas:
    part.positions = h5read(path, '/mesh/positions');    % MATLAB, too, stores column by column
    part.nodeNumbers = h5read(path, '/mesh/node_numbers');
    info = h5info(path, '/interfaces');
    for k = 1:numel(info.Groups)
        group = sprintf('/interfaces/%d', k - 1);
        part.interfaces(k).name = textOf(group, 'name');
        part.interfaces(k).position = h5read(path, [group '/position']);
        part.interfaces(k).Phi = h5read(path, [group '/Phi']);  % 3 x modes: translation of the master
        part.interfaces(k).Psi = h5read(path, [group '/Psi']);  % 3 x modes: its rotation
    end
    fprintf('%s: %g kg, %d modes\n', part.name, part.mass, numel(part.frequencies));
    fprintf('%12.6g Hz\n', part.frequencies);

    xi = zeros(size(part.omegaSquared));
    if nargin < 2
        return
    end
    for load = loads
        seat = part.interfaces(strcmp({part.interfaces.name}, load.name));
        if isempty(seat)
            error('there is no interface ''%s''', load.name);
        end
        xi = xi + (seat.Phi' * load.load(1:3) + seat.Psi' * load.load(4:6)) ./ part.omegaSquared;
    end
    u = reshape(part.Phi * xi, 3, []);
    [largest, node] = max(vecnorm(u));
    fprintf('largest displacement %g m, of node %d\n', largest, part.nodeNumbers(node));
    for seat = part.interfaces
        fprintf('%s moves (%g, %g, %g) m, turns (%g, %g, %g) rad\n', seat.name, seat.Phi * xi, seat.Psi * xi);
    end
end
