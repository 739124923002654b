#pragma once

#include <string>
#include <vector>

#include <flyball/io/plot.hpp>
#include <flyball/study/analyze.hpp>
#include <flyball/study/design.hpp>
#include <flyball/study/identify.hpp>
#include <flyball/study/tune.hpp>

namespace flyball::report {

/// A picture, and what it shows in words.
struct Figure {
  std::string section;  ///< The document's section it belongs to.
  std::string name;     ///< Of its files, without extension: "fit_1_quasistatic-forward".
  std::string title;
  std::string description;  ///< For who cannot see it, and below it for who can.
  Plot plot;
};

/// Each run, measured against simulated; as recorded where nothing was simulated.
[[nodiscard]] std::vector<Figure> figures_of(const study::IdentifyResult& result);
/// Closed-loop response, estimate against truth, pole map.
[[nodiscard]] std::vector<Figure> figures_of(const study::DesignResult& result);
[[nodiscard]] std::vector<Figure> figures_of(const study::TuneResult& result);
/// Pole map and step responses.
[[nodiscard]] std::vector<Figure> figures_of(const study::ModelAnalysis& result);

struct RenderedFigure {
  Figure figure;
  std::string svg;  ///< Empty if it could not be drawn.
  std::string png;  ///< Empty if it could not be drawn or was not asked for.
  std::string problem;
};

/// Draws them, a few at a time. @param png  Whether PNGs are wanted too.
[[nodiscard]] std::vector<RenderedFigure> render(std::vector<Figure> figures, bool png);

}  // namespace flyball::report
