#pragma once
/** @file
Universal files (SDRC I-DEAS), written by modal test systems. Supported datasets:

    dataset 55  data at nodes: shapes of normal and complex modes
    dataset 58  functions at nodal freedoms: frequency response functions, as text

Other datasets are skipped. Formats: Structural Dynamics Research Laboratory, University of
Cincinnati, "Universal File Formats for Modal Analysis Testing". **/

#include <complex>
#include <map>
#include <string>
#include <vector>

namespace simflex {
namespace model {

struct UniversalFile {
    struct Freedom {
        int node = 0;
        int direction = 0;  ///< 1 x, 2 y, 3 z, 4 … 6 rotations; negative: opposite direction; 0: a
                            ///< scalar
        bool operator<(const Freedom& other) const {
            return node != other.node ? node < other.node : direction < other.direction;
        }
    };
    struct Shape {
        double frequency = 0;  ///< [Hz]
        std::map<Freedom, std::complex<double>> values;
    };
    std::vector<Shape> shapes;
    struct Response {
        Freedom output, reference;
        std::vector<double> frequency;  ///< [Hz]
        std::vector<std::complex<double>> values;
    };
    std::vector<Response> responses;
};

/** @throws std::runtime_error naming file and line. **/
UniversalFile readUniversalFile(const std::string& path);

}  // namespace model
}  // namespace simflex
