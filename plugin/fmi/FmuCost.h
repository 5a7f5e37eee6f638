#pragma once
/** @file What it has cost to ask instances of FMUs. Internal. **/

namespace simflex {

struct FmuCost {
    double exchanges = 0;
    double seconds = 0;         ///< from question to answer
    double librarySeconds = 0;  ///< of these, in the libraries themselves

    FmuCost& operator+=(const FmuCost& other) {
        exchanges += other.exchanges;
        seconds += other.seconds;
        librarySeconds += other.librarySeconds;
        return *this;
    }
};

}  // namespace simflex
