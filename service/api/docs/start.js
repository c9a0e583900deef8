// Shows the first paragraph of the description, then the operations, then the other paragraphs.
const operationsFirst = ({ React, getComponent, specSelectors }) => {
  const { createElement: h, Fragment } = React;
  const paragraphs = () => specSelectors.info().get("description", "").split("\n\n");
  const withProse = (Operations) => (props) => h(Fragment, null,
    h(Operations, props),
    h("section", { className: "info" },
      h("h2", { className: "title" }, "About all operations"),
      h(getComponent("Markdown", true), { source: paragraphs().slice(1).join("\n\n") })));
  return {
    wrapComponents: { operations: withProse },
    statePlugins: {
      spec: { wrapSelectors: { selectInfoDescriptionField: () => () => paragraphs()[0] } },
    },
  };
};
SwaggerUIBundle({
  url: "openapi.json",
  dom_id: "#docs",
  deepLinking: true,
  validatorUrl: null,
  plugins: [operationsFirst],
});
