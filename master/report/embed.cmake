# cmake -DOUT=x.cc "-DSTYLES=a.css|b.css" "-DSCRIPTS=a.js|b.js" -P embed.cmake
# Writes a C++ source with the files as string literals (master/report/page_frame.h).
function(literals list variable names)
  set(text "")
  string(REPLACE "|" ";" files "${list}")
  foreach(file IN LISTS files)
    file(READ ${file} content)
    # A browser reads CRLF as LF, and then the hash of the security policy would not match.
    string(REPLACE "\r\n" "\n" content "${content}")
    if(content MATCHES "</(script|style)|<!--")
      message(FATAL_ERROR "${file} would end the element that it is embedded in")
    endif()
    string(APPEND text "    R\"asset(${content})asset\",\n")
  endforeach()
  set(${variable} "constexpr std::string_view ${names}[] = {\n${text}};\n" PARENT_SCOPE)
endfunction()

literals("${STYLES}" styles kStyles)
literals("${SCRIPTS}" scripts kScripts)
file(WRITE ${OUT}
"#include \"master/report/page_frame.h\"

namespace gapfarm {
namespace {

${styles}
${scripts}
}  // namespace

std::span<const std::string_view> page_styles() { return kStyles; }
std::span<const std::string_view> page_scripts() { return kScripts; }

}  // namespace gapfarm
")
