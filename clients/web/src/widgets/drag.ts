// The type of what is dragged from the list of channels onto a plot: a channel and a field.
export const kDragType = "text/ruedo-field";
