#include "simflex/model/Spectra.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "Simbody.h"
#include "simflex/base/FourierTransform.h"
#include "simflex/base/NumberText.h"

namespace simflex {

namespace {

constexpr double WholeTurn = 6.283185307179586;
constexpr size_t FewestRows = 8;
constexpr double EvenInterval = 1e-4;  // relative; times are rounded to a few digits
                                       // a few digits
constexpr double RowsPerPeriod = 2.5;  // least rows per period of an order

/** Number of evenly spaced times: all, or all but the last. **/
size_t countEvenTimes(const std::vector<double>& time, const std::vector<double>& values) {
    if (time.size() != values.size())
        throw std::invalid_argument("there are " + std::to_string(values.size()) + " values at " +
                                    std::to_string(time.size()) + " times");
    if (time.size() < FewestRows)
        throw std::invalid_argument(std::to_string(time.size()) +
                                    " rows are too few for frequencies: at least " +
                                    std::to_string(FewestRows));
    const double interval = (time[time.size() - 2] - time[0]) / double(time.size() - 2);
    for (size_t k = 1; k < time.size(); ++k) {
        const double step = time[k] - time[k - 1];
        if (std::abs(step - interval) <= EvenInterval * interval) continue;
        if (k + 1 == time.size() && step < interval) return time.size() - 1;
        throw std::invalid_argument("rows are not evenly spaced: " + writeGeneral(step, 4) +
                                    " s before t = " + writeGeneral(time[k], 6) + " s, " +
                                    writeGeneral(interval, 4) +
                                    " s elsewhere; run it with a constant interval");
    }
    return time.size();
}

void requireFinite(const std::vector<double>& values, const std::vector<double>& time) {
    for (size_t k = 0; k < values.size(); ++k)
        if (!std::isfinite(values[k]))
            throw std::invalid_argument("there is no value at t = " + writeGeneral(time[k], 6) +
                                        " s");
}

double calcHann(size_t k, size_t count) {
    return 0.5 - 0.5 * std::cos(WholeTurn * (double(k) + 0.5) / double(count));
}

/** Amplitudes at k/(count·interval), of values from `first` on. **/
std::vector<double> calcAmplitudes(const std::vector<double>& values, size_t first, size_t count) {
    double mean = 0, sum = 0;
    for (size_t k = 0; k < count; ++k) {
        mean += calcHann(k, count) * values[first + k];
        sum += calcHann(k, count);
    }
    mean /= sum;
    std::vector<double> windowed(count);
    for (size_t k = 0; k < count; ++k)
        windowed[k] = calcHann(k, count) * (values[first + k] - mean);
    const auto transformed = calcFourierTransform(windowed);
    std::vector<double> amplitudes(count / 2 + 1);
    for (size_t k = 0; k < amplitudes.size(); ++k)
        amplitudes[k] = (k == 0 || 2 * k == count ? 1 : 2) * std::abs(transformed[k]) / sum;
    return amplitudes;
}

std::vector<double> listFrequencies(size_t count, double interval) {
    std::vector<double> frequencies(count / 2 + 1);
    for (size_t k = 0; k < frequencies.size(); ++k)
        frequencies[k] = double(k) / (double(count) * interval);
    return frequencies;
}

}  // namespace

AmplitudeSpectrum calcSpectrum(const std::vector<double>& time, const std::vector<double>& values) {
    const size_t count = countEvenTimes(time, values);
    requireFinite(values, time);
    return {listFrequencies(count, (time[count - 1] - time[0]) / double(count - 1)),
            calcAmplitudes(values, 0, count)};
}

bool isAliased(const AmplitudeSpectrum& spectrum) {
    constexpr double upperShare = 0.9, mostOfLargest = 0.02;
    const auto begin = spectrum.amplitude.begin(), end = spectrum.amplitude.end();
    if (begin == end) return false;
    const auto upper = begin + std::ptrdiff_t(upperShare * double(end - begin));
    if (upper == end) return false;
    return *std::max_element(upper, end) > mostOfLargest * *std::max_element(begin, end);
}

Waterfall calcWaterfall(const std::vector<double>& time, const std::vector<double>& values,
                        const std::vector<double>& speed, int numPieces) {
    const size_t all = countEvenTimes(time, values);
    requireFinite(values, time);
    if (!speed.empty() && speed.size() != time.size())
        throw std::invalid_argument("there are " + std::to_string(speed.size()) + " speeds at " +
                                    std::to_string(time.size()) + " times");
    if (numPieces < 1) throw std::invalid_argument("a waterfall must have at least one piece");
    // Segments of 2 h rows, h apart.
    const size_t count = std::max<size_t>(1, 2 * all / (size_t(numPieces) + 1));
    if (count < FewestRows)
        throw std::invalid_argument(std::to_string(all) + " rows make " +
                                    std::to_string(numPieces) + " pieces of " +
                                    std::to_string(count) + ": at least " +
                                    std::to_string(FewestRows) + " each are needed");
    const double interval = (time[all - 1] - time[0]) / double(all - 1);
    Waterfall waterfall;
    waterfall.frequency = listFrequencies(count, interval);
    for (int piece = 0; piece < numPieces; ++piece) {
        const size_t first =
            numPieces == 1 ? 0 : size_t(piece) * (all - count) / size_t(numPieces - 1);
        waterfall.time.push_back(0.5 * (time[first] + time[first + count - 1]));
        if (!speed.empty()) {
            double mean = 0;
            for (size_t k = 0; k < count; ++k) mean += speed[first + k] / double(count);
            waterfall.speed.push_back(mean);
        }
        waterfall.amplitude.push_back(calcAmplitudes(values, first, count));
    }
    return waterfall;
}

std::vector<OrderTrack> trackOrders(const std::vector<double>& time,
                                    const std::vector<double>& values,
                                    const std::vector<double>& speed,
                                    const std::vector<double>& orders, double revolutions) {
    const size_t all = countEvenTimes(time, values);
    requireFinite(values, time);
    requireFinite(speed, time);
    if (speed.size() != time.size())
        throw std::invalid_argument("there are " + std::to_string(speed.size()) + " speeds at " +
                                    std::to_string(time.size()) + " times");
    if (orders.empty()) throw std::invalid_argument("no order is given");
    for (size_t k = 0; k < orders.size(); ++k)
        if (!(orders[k] > 0) || std::count(orders.begin(), orders.end(), orders[k]) > 1)
            throw std::invalid_argument("orders must be positive and different: " +
                                        writeGeneral(orders[k], 6));
    if (!(revolutions > 0))
        throw std::invalid_argument("the revolutions of a piece must be positive");
    const double interval = (time[all - 1] - time[0]) / double(all - 1);

    // Integrate the quadratic through three speeds, so that θ is of third order.
    std::vector<double> angle(all, 0);
    double fastest = 0;
    bool hasForward = false, hasBackward = false;
    for (size_t k = 0; k < all; ++k) {
        fastest = std::max(fastest, std::abs(speed[k]));
        hasForward = hasForward || speed[k] > 0;
        hasBackward = hasBackward || speed[k] < 0;
        if (k == 0) continue;
        const size_t m = k + 1 < all ? k : k - 1;  // middle one of the three
        const double bend = speed[m + 1] - 2 * speed[m] + speed[m - 1];
        angle[k] = angle[k - 1] + interval * (0.5 * (speed[k - 1] + speed[k]) - bend / 12);
    }
    if (hasForward && hasBackward)
        throw std::invalid_argument("the speed changes its sign: choose a time before or after");
    const double highest = *std::max_element(orders.begin(), orders.end());
    const double shortest = fastest > 0 ? WholeTurn / (highest * fastest) : 1e300;
    if (interval * RowsPerPeriod > shortest)
        throw std::invalid_argument("rows " + writeGeneral(interval, 4) +
                                    " s apart are too few for order " + writeGeneral(highest, 6) +
                                    " at " + writeGeneral(fastest, 6) + " rad/s, whose period is " +
                                    writeGeneral(shortest, 4) +
                                    " s: run it with a shorter interval, or choose a time before");

    std::vector<OrderTrack> tracks;
    for (const double order : orders) tracks.push_back({order, {}, {}, {}, {}});
    const double length = WholeTurn * revolutions;
    const auto reach = [&](size_t k) { return std::abs(angle[k] - angle[0]); };
    if (reach(all - 1) < length)
        throw std::invalid_argument(
            "the motion makes " + writeGeneral(reach(all - 1) / WholeTurn, 4) +
            " revolutions, fewer than a piece of " + writeGeneral(revolutions, 4));
    const int numOrders = int(orders.size()), unknowns = 2 + 2 * numOrders;
    for (double from = 0; from + length <= reach(all - 1) * (1 + 1e-12); from += 0.5 * length) {
        size_t first = 0, end = 0;
        while (reach(first) < from) ++first;
        end = first;
        while (end < all && reach(end) <= from + length * (1 + 1e-12)) ++end;
        const size_t count = end - first;
        if (int(count) < 2 * unknowns)
            throw std::invalid_argument(
                std::to_string(count) + " rows in " + writeGeneral(revolutions, 4) +
                " revolutions cannot tell " + std::to_string(numOrders) +
                " orders apart: run it with a shorter interval, or take more revolutions");
        const int numRows = int(count);
        SimTK::Matrix A(numRows, unknowns);
        SimTK::Vector b(numRows), x;
        double middle = 0, meanSpeed = 0, weights = 0;
        const double start = time[first], duration = time[end - 1] - time[first];
        for (size_t k = 0; k < count; ++k) {
            const double w = calcHann(k, count), root = std::sqrt(w);
            const int row = int(k);
            A(row, 0) = root;
            A(row, 1) = root * (time[first + k] - start) / duration;
            for (int o = 0; o < numOrders; ++o) {
                const double phase = orders[size_t(o)] * reach(first + k);
                A(row, 2 + 2 * o) = root * std::cos(phase);
                A(row, 3 + 2 * o) = root * std::sin(phase);
            }
            b[row] = root * values[first + k];
            middle += w * time[first + k];
            meanSpeed += w * speed[first + k];
            weights += w;
        }
        SimTK::FactorQTZ(A).solve(b, x);
        for (int o = 0; o < numOrders; ++o) {
            OrderTrack& track = tracks[size_t(o)];
            track.time.push_back(middle / weights);
            track.speed.push_back(meanSpeed / weights);
            track.amplitude.push_back(std::hypot(x[2 + 2 * o], x[3 + 2 * o]));
            track.phase.push_back(std::atan2(-x[3 + 2 * o], x[2 + 2 * o]) * 360 / WholeTurn);
        }
    }
    return tracks;
}

}  // namespace simflex
