#pragma once

#include <string>
#include <utility>
#include <vector>

#include <flyball/report/html.hpp>

#include "report/document.hpp"
#include "report/figures.hpp"

namespace flyball::report {

/// What the page's last section tells, beside version and command: name and value.
using Origins = std::vector<std::pair<std::string, std::string>>;

/// The whole page. Pictures stand at the end of the section that they name.
[[nodiscard]] std::string render_html(const Document& document,
                                      const std::vector<RenderedFigure>& figures,
                                      const Origins& origins, const Provenance& provenance);

/// The page of a result whose pictures are drawn already.
[[nodiscard]] std::string page_of(const study::IdentifyResult& result,
                                  const std::vector<RenderedFigure>& figures,
                                  const Provenance& provenance);
[[nodiscard]] std::string page_of(const study::DesignResult& result,
                                  const std::vector<RenderedFigure>& figures,
                                  const Provenance& provenance);
[[nodiscard]] std::string page_of(const study::TuneResult& result,
                                  const std::vector<RenderedFigure>& figures,
                                  const Provenance& provenance);
[[nodiscard]] std::string page_of(const study::ModelAnalysis& result,
                                  const std::vector<RenderedFigure>& figures,
                                  const Provenance& provenance);

}  // namespace flyball::report
