" SPDX-License-Identifier: Apache-2.0
" Syntax of dpde's models. tests/lsp holds the words against those of the parser.
if exists("b:current_syntax")
  finish
endif
syntax case match
syntax keyword dpdeOption about above adjoint after at axes beside bounded by cells every field for from grow halo in
syntax keyword dpdeOption initial inside iterations logarithmic of on order over param periodic preconditioner projected scalar scene seed smoother
syntax keyword dpdeOption steady step steps stretched time to tolerance two_thirds vector warn weights where with within
syntax keyword dpdeSide zero_gradient linear outflow pole gradient mixed radiating
syntax keyword dpdeOperator and or not
syntax keyword dpdeConstant pi t x y z
syntax match dpdeLine /\v(^|[{};])@1<=\s*<(accuracy|adjoint|after|apply|at|axes|boundary|cells|coarsen|coefficient|control|coordinates|correlation|data|error|every|exact|field|file|fill|fold|frames|gradient|grid|growth|host|initial|keep|learn|let|load|mask|minimise|newton|observe|output|padding|param|real|reduce|reference|repeat|residual|run|runs|save|second|seed|skip|solve|spectrum|statistic|step|subcycle|swap|symmetric|tangent|test|time|tolerance|transform|unknown|using|vary|vector)>(\s*(\=|\())@!/
syntax match dpdeFunction /\v<(dx|dy|dz|d|lap|grad|div|advect|bracket|dot|curl|norm|if|mean|sum|integral|inject|sample|interpolate|random_field|random_signal|noise|force_on|torque_on|cross|outer|inner|sym|transpose|trace|average|band_pass|sin|cos|tan|asin|acos|atan|atan2|sinh|cosh|tanh|exp|log|erf|sqrt|abs|sign|floor|fraction|min|max|dt)>(\s*\()@=/
syntax match dpdeKey /\v<(advect|dx|lap|dealias|implicit|solve|smoother|preconditioner|guess|project|time|real|networks|split)>((\s+[A-Za-z_.0-9]+)?\s*\=)@=/
syntax match dpdeDeclaration /\v(^|[};])@1<=\s*<(model|scene|scheme|task|kernel|program|loop|function|operator|network|dataset|import|chart)>(\s+[A-Za-z_"])@=/
syntax match dpdeUnit /\v(<in\s+)@<=(1\ze\/|\(?((da|[TGMkhdcmunpf])?(m|g|s|A|K|mol|cd|rad|Hz|N|Pa|J|W|V|C|F|ohm|S|Wb|T|H|L|bar|eV)|min|h|day|year|deg|sr)>)[A-Za-z0-9^*\/()-]*/
syntax match dpdeNumber /\v<\d+(\.\.@!\d*)?([eE][+-]?\d+)?/
syntax region dpdeText start=/"/ end=/"/ oneline
syntax match dpdeComment /#.*$/ contains=@Spell

highlight default link dpdeDeclaration Structure
highlight default link dpdeLine Statement
highlight default link dpdeOption Keyword
highlight default link dpdeSide Constant
highlight default link dpdeKey Identifier
highlight default link dpdeFunction Function
highlight default link dpdeOperator Operator
highlight default link dpdeConstant Constant
highlight default link dpdeNumber Number
highlight default link dpdeUnit Special
highlight default link dpdeText String
highlight default link dpdeComment Comment

let b:current_syntax = "dpde"
