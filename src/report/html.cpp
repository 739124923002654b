#include <flyball/report/html.hpp>

#include <algorithm>

#include <fmt/format.h>

#include <flyball/core/version.hpp>

#include "report/format.hpp"
#include "report/page_parts.hpp"
#include "report/pictures.hpp"
#include "report/plot_data.hpp"

namespace flyball::report {

namespace {

std::string_view class_of(Tone tone) {
  switch (tone) {
    case Tone::good:
      return "good";
    case Tone::caution:
      return "caution";
    case Tone::bad:
      return "bad";
    case Tone::quiet:
      return "quiet";
    case Tone::plain:
      break;
  }
  return {};
}

std::string class_attribute(std::string_view first, Tone tone) {
  const std::string_view second = class_of(tone);
  if (first.empty() && second.empty()) {
    return "";
  }
  return fmt::format(" class=\"{}{}{}\"", first, first.empty() || second.empty() ? "" : " ",
                     second);
}

/// A mark that does not need colour to be told apart.
std::string_view mark_of(Tone tone) {
  switch (tone) {
    case Tone::good:
      return "✔ ";
    case Tone::caution:
      return "▲ ";
    case Tone::bad:
      return "✖ ";
    case Tone::quiet:
    case Tone::plain:
      break;
  }
  return {};
}

std::string render(const Facts& facts) {
  std::string out = "<table class=\"facts\"><tbody>\n";
  for (const Facts::Fact& fact : facts.facts) {
    out += fmt::format("<tr><th scope=\"row\" class=\"w\">{}</th><td{}>{}</td></tr>\n",
                       escape_html(fact.name), class_attribute("w", fact.value.tone),
                       escape_html(fact.value.text));
  }
  return out + "</tbody></table>\n";
}

std::string render(const Table& table) {
  const auto words = [&](std::size_t column) { return table.is_words(column) ? "w" : ""; };
  std::string out = "<div class=\"scroll\"><table>\n";
  if (!table.caption.empty()) {
    out += "<caption>" + escape_html(table.caption) + "</caption>\n";
  }
  out += "<thead><tr>";
  for (std::size_t c = 0; c < table.header.size(); ++c) {
    out += fmt::format("<th scope=\"col\"{}>{}</th>", class_attribute(words(c), Tone::plain),
                       escape_html(table.header[c]));
  }
  out += "</tr></thead>\n<tbody>\n";
  for (const auto& row : table.rows) {
    out += "<tr>";
    for (std::size_t c = 0; c < row.size(); ++c) {
      const std::string_view tag = c == 0 ? "th" : "td";
      out += fmt::format("<{}{}{}>{}</{}>", tag, c == 0 ? " scope=\"row\"" : "",
                         class_attribute(words(c), row[c].tone), escape_html(row[c].text), tag);
    }
    out += "</tr>\n";
  }
  return out + "</tbody></table></div>\n";
}

std::string render(const Paragraph& paragraph) {
  return fmt::format("<p{}>{}{}</p>\n", class_attribute("", paragraph.tone),
                     mark_of(paragraph.tone), escape_html(paragraph.text));
}

std::string render(const Findings& findings) {
  std::string out = "<ul class=\"findings\">\n";
  for (const Diagnostic& diagnostic : findings.diagnostics) {
    out += fmt::format("<li><span{}>{}</span> {} <code class=\"quiet\">{}</code></li>\n",
                       class_attribute("badge", tone_of(diagnostic.severity)),
                       to_string(diagnostic.severity), escape_html(diagnostic.message),
                       escape_html(diagnostic.code));
  }
  return out + "</ul>\n";
}

std::string render(const Code& code) {
  return fmt::format("<details><summary>{}</summary><pre><code>{}</code></pre></details>\n",
                     escape_html(code.title), escape_html(code.text));
}

std::string render(const Steps& steps) {
  std::string out = "<ol class=\"steps\">\n";
  for (const std::string& step : steps.steps) {
    out += "<li>" + escape_html(step) + "</li>\n";
  }
  return out + "</ol>\n";
}

/// The <svg> element without what may stand before it in a file.
std::string_view svg_element(std::string_view svg) {
  const std::size_t at = svg.find("<svg");
  return at == std::string_view::npos ? std::string_view() : svg.substr(at);
}

/// Identifiers inside a picture are made its own: a page must not hold one twice.
std::string with_own_ids(std::string_view svg, std::size_t number) {
  const std::string prefix = fmt::format("p{}-", number);
  std::string out;
  out.reserve(svg.size() + svg.size() / 16);
  std::size_t at = 0;
  while (at < svg.size()) {
    std::size_t end = std::string_view::npos;
    std::size_t length = 0;
    for (const std::string_view key : {" id=\"", " id='", "href=\"#", "href='#", "url(#"}) {
      const std::size_t found = svg.find(key, at);
      if (found < end) {
        end = found;
        length = key.size();
      }
    }
    if (end == std::string_view::npos) {
      break;
    }
    out += svg.substr(at, end + length - at);
    out += prefix;
    at = end + length;
  }
  out += svg.substr(at);
  return out;
}

std::string render(const Picture& picture, std::size_t number) {
  const Figure& figure = picture.figure;
  const std::string label = escape_html(figure.title + ". " + figure.description);
  const std::string_view svg = svg_element(picture.svg);
  std::string out = fmt::format("<figure class=\"plot{}\" data-name=\"{}\">\n",
                                svg.empty() ? "" : " drawn", escape_html(figure.name));
  if (svg.empty()) {
    out +=
        fmt::format("<div class=\"still\"><p>▲ The picture “{}” could not be drawn: {}</p></div>\n",
                    escape_html(figure.title), escape_html(picture.problem));
  } else {
    out += fmt::format("<div class=\"still\" role=\"img\" aria-label=\"{}\">\n{}</div>\n", label,
                       with_own_ids(svg, number));
  }
  return out + fmt::format(
                   "<script type=\"application/json\">{}</script>\n"
                   "<figcaption>{}</figcaption>\n</figure>\n",
                   plot_data(figure), escape_html(figure.description));
}

/// Hidden where no script can move it.
std::string render(const Animation& animation) {
  return fmt::format(
      "<figure class=\"animation\" data-name=\"{}\">\n"
      "<script type=\"application/json\">{}</script>\n"
      "<figcaption>{}</figcaption>\n</figure>\n",
      escape_html(animation.name), animation_data(animation), escape_html(animation.description));
}

/// That still pictures are missing, and what there is in their place.
std::string missing_stills(const std::vector<Picture>& pictures) {
  const auto missing = [](const Picture& picture) { return svg_element(picture.svg).empty(); };
  const auto first = std::find_if(pictures.begin(), pictures.end(), missing);
  if (first == pictures.end()) {
    const auto problem = [](const Picture& picture) { return !picture.problem.empty(); };
    const auto found = std::find_if(pictures.begin(), pictures.end(), problem);
    return found == pictures.end()
               ? ""
               : fmt::format(
                     "<p class=\"caution\">▲ {} of {} pictures beside this page could not be drawn "
                     "as PNG: {}. Those in the page and their SVG are here.</p>\n",
                     std::count_if(found, pictures.end(), problem), pictures.size(),
                     escape_html(found->problem));
  }
  return fmt::format(
      "<p class=\"caution\">▲ {} of {} still pictures could not be drawn: {}. The interactive "
      "plots "
      "are here, where scripts run; prints and other pages lack those pictures.</p>\n",
      std::count_if(first, pictures.end(), missing), pictures.size(), escape_html(first->problem));
}

/// Plots that answer: dygraphs' script and the page's own. It needs no more, whatever a text says.
std::string scripts() {
  return fmt::format("<script>{}</script>\n<script>\n{}</script>\n", dygraphs_script, page_script);
}

std::string heading(const Section& section) {
  return fmt::format("<section id=\"{}\" aria-labelledby=\"h-{}\">\n<h2 id=\"h-{}\">{}</h2>\n",
                     section.id, section.id, section.id, escape_html(section.title));
}

std::string origin_section(const Facts& origins, const Provenance& provenance) {
  std::string out = heading({"origin", "How it was made", {}});
  Facts facts;
  facts.add("Flyball", std::string(version));
  if (!provenance.command.empty()) {
    facts.add("command", provenance.command);
  }
  facts.facts.insert(facts.facts.end(), origins.facts.begin(), origins.facts.end());
  out += render(facts);
  if (!provenance.files.empty()) {
    out += "<p>Beside this page:</p>\n<ul>\n";
    for (const std::string& file : provenance.files) {
      out += fmt::format("<li><a href=\"{0}\">{0}</a></li>\n", escape_html(file));
    }
    out += "</ul>\n";
  }
  return out + "</section>\n";
}

}  // namespace

std::string page_of(const Document& document, const std::vector<Picture>& pictures,
                    const std::vector<Animation>& animations, const Provenance& provenance) {
  std::string out = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "
      "style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:\">\n"
      "<meta name=\"generator\" content=\"Flyball {}\">\n<title>{} – Flyball</title>\n"
      "<style>{}</style>\n</head>\n<body>\n",
      version, escape_html(document.title), page_style);
  out += fmt::format("<header>\n<h1>{}</h1>\n", escape_html(document.title));
  out += fmt::format("<div{}><strong>{}{}</strong>\n",
                     class_attribute("verdict", document.verdict.tone),
                     mark_of(document.verdict.tone), escape_html(document.verdict.line));
  if (!document.verdict.reasons.empty()) {
    out += "<ul>\n";
    for (const std::string& reason : document.verdict.reasons) {
      out += "<li>" + escape_html(reason) + "</li>\n";
    }
    out += "</ul>\n";
  }
  out += "</div>\n" + missing_stills(pictures) + "<nav aria-label=\"Sections\"><ul>\n";
  for (const Section& section : document.sections) {
    out += fmt::format("<li><a href=\"#{}\">{}</a></li>\n", section.id, escape_html(section.title));
  }
  out += "<li><a href=\"#origin\">How it was made</a></li>\n</ul></nav>\n</header>\n<main>\n";
  std::size_t number = 0;
  for (const Section& section : document.sections) {
    out += heading(section);
    for (const Block& block : section.blocks) {
      out += std::visit([](const auto& b) { return render(b); }, block);
    }
    for (const Animation& animation : animations) {
      if (animation.section == section.id) {
        out += render(animation);
      }
    }
    for (const Picture& picture : pictures) {
      if (picture.figure.section == section.id) {
        out += render(picture, ++number);
      }
    }
    out += "</section>\n";
  }
  out += origin_section(document.origins, provenance);
  out += "</main>\n";
  return out + (pictures.empty() && animations.empty() ? "" : scripts()) + "</body>\n</html>\n";
}

std::string to_html(const Answer& answer, const Provenance& provenance) {
  return page_of(answer.document, draw(answer.figures, false), answer.animations, provenance);
}

}  // namespace flyball::report
