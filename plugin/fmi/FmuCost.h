#pragma once
/** @file Cost of exchanges with FMU instances. Internal. **/

namespace simflex {

struct FmuCost {
    double exchanges = 0;
    double seconds = 0;         ///< from call to reply
    double librarySeconds = 0;  ///< part spent in the libraries

    FmuCost& operator+=(const FmuCost& other) {
        exchanges += other.exchanges;
        seconds += other.seconds;
        librarySeconds += other.librarySeconds;
        return *this;
    }
};

}  // namespace simflex
