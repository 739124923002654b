#include <string>
#include <utility>

#include "book/figure_functions.hpp"

namespace flyball::book {

namespace {

/// A picture that the book prints twice, under its other number.
FigureResult again(FigureResult figure, std::string id) {
  figure.id = std::move(id);
  return figure;
}

}  // namespace

/// Figure E.2: Figure 6.1 in section E.2.2.
FigureResult figure_E_2() {
  return again(figure_6_1(), "E.2");
}

/// Figures E.5 and E.15: Figure 6.6 in sections E.2.3 and E.3.6.
FigureResult figure_E_5() {
  return again(figure_6_6(), "E.5");
}
FigureResult figure_E_15() {
  return again(figure_6_6(), "E.15");
}

/// Figures E.6 and E.16: Figure 6.7 in sections E.2.3 and E.3.6.
FigureResult figure_E_6() {
  return again(figure_6_7(), "E.6");
}
FigureResult figure_E_16() {
  return again(figure_6_7(), "E.16");
}

/// Figure E.17: Figures 7.1 and 7.6 in section E.4. Its data are the z-plane's.
FigureResult figure_E_17() {
  return again(figure_7_6(), "E.17");
}

/// Figures E.18 and E.19: Figures 7.2 and 7.3 in section E.4.2.
FigureResult figure_E_18() {
  return again(figure_7_2(), "E.18");
}
FigureResult figure_E_19() {
  return again(figure_7_3(), "E.19");
}

/// Table E.2: Table 7.1 in section E.4.
FigureResult table_E_2() {
  return again(table_7_1(), "table E.2");
}

/// Table E.3: Table 7.3 for a scalar, whose A T is T s (section E.5).
FigureResult table_E_3() {
  return again(table_7_3(), "table E.3");
}

}  // namespace flyball::book
