#include "simflex/model/results/UniversalFile.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "simflex/base/NumberText.h"
#include "simflex/part/TextLines.h"

namespace simflex {
namespace model {
namespace {

constexpr int MostNumbers = 100000000;  // largest dataset

std::vector<std::string> splitAtBlanks(std::string_view line) {
    std::vector<std::string> fields;
    bool isInside = false;
    for (const char c : line) {
        const bool isBlank = c == ' ' || c == '\t' || c == '\r';
        if (!isBlank && !isInside) fields.emplace_back();
        if (!isBlank) fields.back() += c;
        isInside = !isBlank;
    }
    return fields;
}

class UniversalReader {
public:
    explicit UniversalReader(const std::string& path) : m_lines(path, "universal file") {}

    UniversalFile read() {
        while (m_lines.nextFilled()) {
            if (!isMark()) m_lines.refuse("a dataset of a universal file begins with -1");
            if (!m_lines.nextFilled()) break;
            const std::string head = splitAtBlanks(m_lines.line())[0];
            if (head == "58b") m_lines.refuse("this dataset 58 is binary: write it as text");
            const std::string digits = head.substr(0, head.size() - (head.back() == 'b' ? 1 : 0));
            const int number = m_lines.parseInteger(digits, "the dataset's number");
            if (number == 55)
                readShape();
            else if (number == 58)
                readResponse();
            else
                passOver();
        }
        return std::move(m_file);
    }

private:
    bool isMark() const { return trimBlanks(m_lines.line()) == "-1"; }
    void passOver() {
        while (m_lines.next() && !isMark()) {
        }
    }
    void advance() {
        if (!m_lines.next() || isMark()) m_lines.refuse("the dataset ends too early");
    }

    /** Fields of the current line: split at blanks if that gives the right number, else by fixed
    widths, since FORTRAN's numbers may fill their fields. **/
    std::vector<std::string> getFields(const std::vector<int>& widths) {
        std::vector<std::string> fields = splitAtBlanks(m_lines.line());
        if (fields.size() == widths.size()) return fields;
        fields.clear();
        size_t at = 0;
        const std::string_view line = m_lines.line();
        for (const int width : widths) {
            if (at >= line.size()) break;
            fields.emplace_back(trimBlanks(line.substr(at, size_t(width))));
            at += size_t(width);
        }
        return fields;
    }
    std::vector<int> readIntegers(int least, int count, const char* what) {
        advance();
        std::vector<std::string> fields = splitAtBlanks(m_lines.line());
        if (int(fields.size()) < least) fields = getFields(std::vector<int>(size_t(count), 10));
        std::vector<int> values;
        for (const std::string& field : fields)
            if (int(values.size()) < least) values.push_back(m_lines.parseInteger(field, what));
        if (int(values.size()) < least) m_lines.refuse(std::string("there is no ") + what);
        return values;
    }
    /** Reads numbers over as many lines as needed.
    @param widths  of a full line **/
    std::vector<double> readNumbers(size_t count, const std::vector<int>& widths,
                                    const char* what) {
        std::vector<double> values;
        while (values.size() < count) {
            advance();
            const size_t wanted = std::min(widths.size(), count - values.size());
            const auto fields =
                getFields({widths.begin(), widths.begin() + std::ptrdiff_t(wanted)});
            if (fields.size() != wanted)
                m_lines.refuse("there are " + std::to_string(fields.size()) + " numbers, not " +
                               std::to_string(wanted));
            for (const std::string& field : fields)
                values.push_back(m_lines.parseNumber(field, what));
        }
        return values;
    }
    const std::vector<int>& getShortWidths() const {
        static const std::vector<int> widths(6, 13);
        return widths;
    }

    void readShape() {
        for (int k = 0; k < 5; ++k) advance();
        const auto form = readIntegers(6, 6, "record 6");
        const int analysis = form[1], numValues = form[5];
        const bool isComplex = form[4] == 5 || form[4] == 6;
        const bool isMode = analysis == 2 || analysis == 3 || analysis == 7;
        if (!isMode) return passOver();
        if (!isComplex && form[4] != 2 && form[4] != 4)
            m_lines.refuse("data of type " + std::to_string(form[4]) +
                           " are not read: 2 (real) or 5 (complex)");
        if (numValues != 3 && numValues != 6)
            m_lines.refuse("a node of a mode has 3 or 6 values, not " + std::to_string(numValues));
        const auto counts = readIntegers(2, 8, "record 7");
        if (counts[1] < 1 || counts[1] > 1000) m_lines.refuse("it has no frequency");
        const auto numbers = readNumbers(size_t(counts[1]), getShortWidths(), "the mode's numbers");
        UniversalFile::Shape shape;
        if (analysis != 2 && numbers.size() < 2) m_lines.refuse("it has no eigenvalue");
        shape.frequency = analysis == 2
                              ? numbers[0]
                              : std::hypot(numbers[0], numbers[1]) / (2 * 3.14159265358979323846);
        while (true) {
            if (!m_lines.next()) m_lines.refuse("the dataset does not end");
            if (isMark()) break;
            const auto fields = splitAtBlanks(m_lines.line());
            if (fields.empty()) continue;
            const int node = m_lines.parseInteger(fields[0], "a node's number");
            const auto values = readNumbers(size_t(numValues) * (isComplex ? 2 : 1),
                                            getShortWidths(), "a node's values");
            for (int i = 0; i < numValues; ++i)
                shape.values[{node, i + 1}] =
                    isComplex
                        ? std::complex<double>(values[size_t(2 * i)], values[size_t(2 * i + 1)])
                        : std::complex<double>(values[size_t(i)]);
        }
        if (shape.values.empty()) m_lines.refuse("the mode has no nodes");
        m_file.shapes.push_back(std::move(shape));
    }

    void readResponse() {
        for (int k = 0; k < 6; ++k) advance();
        // 2(I5,I10),2(1X,10A1,I10,I4)
        const std::string line(m_lines.line());
        const auto cut = [&](size_t from, size_t count) {
            return from < line.size()
                       ? std::string(trimBlanks(std::string_view(line).substr(from, count)))
                       : std::string();
        };
        const auto fields = splitAtBlanks(line);
        const bool isFree = fields.size() == 10;
        const auto read = [&](size_t place, size_t from, size_t count, const char* what) {
            return m_lines.parseInteger(isFree ? fields[place] : cut(from, count), what);
        };
        if (read(0, 0, 5, "the function's type") != 4) return passOver();
        UniversalFile::Response response;
        response.output = {read(5, 41, 10, "the response's node"),
                           read(6, 51, 4, "the response's direction")};
        response.reference = {read(8, 66, 10, "the reference's node"),
                              read(9, 76, 4, "the reference's direction")};
        advance();
        const auto form = getFields({10, 10, 10, 13, 13, 13});
        if (form.size() < 5) m_lines.refuse("record 7 is too short");
        const int type = m_lines.parseInteger(form[0], "the data's type"),
                  count = m_lines.parseInteger(form[1], "the number of data"),
                  spacing = m_lines.parseInteger(form[2], "the spacing");
        if (type != 2 && type != 4 && type != 5 && type != 6)
            m_lines.refuse("data of type " + std::to_string(type) +
                           " are not read: 2 or 4 (real), 5 or 6 (complex)");
        if (count < 1 || count > MostNumbers / 3) m_lines.refuse("it has no data");
        const bool isComplex = type >= 5, isLong = type == 4 || type == 6, isEven = spacing == 1;
        const double first = isEven ? m_lines.parseNumber(form[3], "the first abscissa") : 0,
                     step = isEven ? m_lines.parseNumber(form[4], "the abscissa's step") : 0;
        for (int k = 0; k < 4; ++k) advance();
        const size_t each = (isComplex ? 2 : 1) + (isEven ? 0 : 1);
        const std::vector<int> widths = !isLong     ? std::vector<int>(6, 13)
                                        : isEven    ? std::vector<int>(4, 20)
                                        : isComplex ? std::vector<int>{13, 20, 20}
                                                    : std::vector<int>{13, 20, 13, 20};
        const auto numbers = readNumbers(size_t(count) * each, widths, "the data");
        for (size_t k = 0; k < size_t(count); ++k) {
            const double* own = &numbers[k * each];
            response.frequency.push_back(isEven ? first + double(k) * step : *own++);
            response.values.emplace_back(own[0], isComplex ? own[1] : 0.0);
        }
        passOver();
        m_file.responses.push_back(std::move(response));
    }

    TextLines m_lines;
    UniversalFile m_file;
};

}  // namespace

UniversalFile readUniversalFile(const std::string& path) {
    try {
        return UniversalReader(path).read();
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error(error.what());
    }
}

}  // namespace model
}  // namespace simflex
