#pragma once
/** @file
Vibrations in what a run has recorded: amplitude spectra, waterfalls and orders of a speed.

    const auto& run = results.findAnalysis("run_up");
    const AmplitudeSpectrum spectrum = calcSpectrum(run.time, bearing);
    const Waterfall waterfall = calcWaterfall(run.time, bearing, speed, 40);
    const OrderTrack once = trackOrders(run.time, bearing, speed, {1, 2})[0];

Times are those of rows, evenly spaced; a last row that comes early (the end of a run) is left out.
What vibrates faster than half the rate of rows is not seen as what it is: it appears at a lower
frequency. See isAliased(). **/

#include <vector>

namespace simflex {

/** Amplitudes of sines: a steady a·sin(2πft) has the peak a. The mean is left out. **/
struct AmplitudeSpectrum {
    std::vector<double> frequency;  ///< [Hz], from 0
    std::vector<double> amplitude;  ///< in the values' unit
};

/** By a Hann window and a Fourier transform of all values: peaks are two resolutions 1/duration
wide to each side, and at least 0.85 of the amplitude high, wherever they fall.
@throws std::invalid_argument if times are not evenly spaced or fewer than 8, or values are not
    finite. **/
AmplitudeSpectrum calcSpectrum(const std::vector<double>& time, const std::vector<double>& values);

/** Whether so much of a spectrum lies just below half the rate of rows that faster vibrations are
to be expected, which appear at wrong frequencies. **/
bool isAliased(const AmplitudeSpectrum& spectrum);

/** Spectra of pieces of a motion that overlap by half. **/
struct Waterfall {
    std::vector<double> time, speed;  ///< in the middle of each piece; speed as given, its mean
    std::vector<double> frequency;    ///< [Hz]
    std::vector<std::vector<double>> amplitude;  ///< of each piece
};

/** @param speed  at each time, or empty
@param numPieces  1 or more
@throws std::invalid_argument as calcSpectrum(), also if pieces would have fewer than 8 rows. **/
Waterfall calcWaterfall(const std::vector<double>& time, const std::vector<double>& values,
                        const std::vector<double>& speed, int numPieces);

/** The part of a vibration that turns with a speed: in each piece, of some revolutions,

    values ≈ c + d·t + Σ a_o cos(o θ) + b_o sin(o θ),   θ = ∫ speed dt

is fitted for all orders o together by least squares, weighed by a Hann window. **/
struct OrderTrack {
    double order;
    std::vector<double> time, speed;  ///< in the middle of each piece
    std::vector<double> amplitude;    ///< √(a² + b²), in the values' unit
    std::vector<double> phase;        ///< of a·cos(oθ + φ), θ from the first row [degrees]
};

/** @param speed  [rad/s], of one sign
@param revolutions  of a piece: the more, the sharper are orders told apart, and the slower may
    amplitudes change
@throws std::invalid_argument if times are not evenly spaced, the speed is not of one sign, the
    motion has fewer revolutions, orders are not positive and different, or rows are too few to
    tell the highest order at the highest speed. **/
std::vector<OrderTrack> trackOrders(const std::vector<double>& time,
                                    const std::vector<double>& values,
                                    const std::vector<double>& speed,
                                    const std::vector<double>& orders, double revolutions = 8);

}  // namespace simflex
