const controls = document.getElementById("joint-controls");
if (controls) {
  const show = () => {
    const chosen = name => controls.querySelector(`input[name=${name}]:checked`).value;
    const wanted = `joints-${chosen("iteration")}-${chosen("view")}`;
    document.querySelectorAll(".joints").forEach(f => { f.hidden = f.id !== wanted; });
  };
  controls.hidden = false;
  controls.addEventListener("change", show);
  show();
}
