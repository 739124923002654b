#pragma once

#include <string>
#include <vector>

#include <flyball/report/html.hpp>

namespace flyball::report {

/// A figure, drawn.
struct Picture {
  Figure figure{};
  std::string svg{};  ///< Empty if it could not be drawn.
  std::string png{};  ///< Empty if it could not be drawn or was not asked for.
  std::string problem{};
  std::string png_problem{};  ///< Taken for `problem` if there is no other.
};

/// Draws them by a few gnuplots. @param png  Whether PNGs are wanted too. @param seconds  What all
/// of them have together; those that are not drawn then have a problem.
[[nodiscard]] std::vector<Picture> draw(const std::vector<Figure>& figures, bool png,
                                        double seconds = 60.0);

/// The page of a document whose pictures are drawn already; they stand at the end of the section
/// that they name.
/// @param animations  Stand before those, where scripts run.
[[nodiscard]] std::string page_of(const Document& document, const std::vector<Picture>& pictures,
                                  const std::vector<Animation>& animations,
                                  const Provenance& provenance);

}  // namespace flyball::report
