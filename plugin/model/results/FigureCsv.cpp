#include "simflex/base/UnfinishedFile.h"
#include "simflex/model/results/CsvLine.h"
#include "simflex/model/results/ResultFigure.h"

namespace simflex {
namespace model {

void writeFigureCsv(const std::string& path, const Figure& figure) {
    std::string text;
    for (const FigurePanel& panel : figure.panels) {
        CsvLine head;
        size_t count = 0;
        for (const FigureCurve& curve : panel.curves) {
            head.add(figure.xLabel)
                .add(curve.name.empty() ? panel.label : curve.name + ": " + panel.label);
            count = std::max(count, curve.x.size());
        }
        if (count > 0) text += head.end();
        for (size_t k = 0; k < count; ++k) {
            CsvLine line;
            for (const FigureCurve& curve : panel.curves)
                if (k < curve.x.size())
                    line.add(curve.x[k]).add(curve.y[k]);
                else
                    line.add("").add("");
            text += line.end();
        }
        if (panel.map.isEmpty()) continue;
        text += CsvLine().add(figure.xLabel).add(panel.label).add(panel.map.label).end();
        for (const auto& [x, y, value] : panel.map.samples)
            text += CsvLine().add(x).add(y).add(value).end();
        if (!panel.map.samples.empty()) continue;
        for (size_t i = 0; i < panel.map.rows.size(); ++i)
            for (size_t k = 0; k < panel.map.y.size(); ++k)
                text += CsvLine()
                            .add(panel.map.x[i])
                            .add(panel.map.y[k])
                            .add(panel.map.rows[i][k])
                            .end();
    }
    replaceFile(path, text);
}

}  // namespace model
}  // namespace simflex
