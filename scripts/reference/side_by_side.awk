# One table of lines `tool name ns`: a row per name, vmerack first, and how many times longer each other tool takes.
# Rows and columns in the order in which vmerack, then the others, first name them.
NF == 3 {
    if (!($2 in seen_row)) { seen_row[$2]; rows[++r] = $2 }
    if ($1 != "vmerack" && !($1 in seen_tool)) { seen_tool[$1]; tools[++t] = $1 }
    ns[$1, $2] = $3
}
END {
    printf "%-14s %10s", "ns a call", "vmerack"
    for (j = 1; j <= t; j++) printf " %17s %7s", tools[j], "ratio"
    print ""
    for (i = 1; i <= r; i++) {
        own = ns["vmerack", rows[i]]
        if (own == "") continue
        printf "%-14s %10.1f", rows[i], own
        for (j = 1; j <= t; j++) {
            other = ns[tools[j], rows[i]]
            if (other == "") printf " %17s %7s", "-", "-"
            else printf " %17.1f %6.2fx", other, other / own
        }
        print ""
    }
}
